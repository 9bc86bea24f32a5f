// SPDX-License-Identifier: Apache-2.0
// What light is made of: the strengths of its parts, where the key light is, what is taken away, and the lens. There where
// light is on; each control is a member of the view, or a part of one.

import { byId } from "./dom";
import { kOtherMembers, withMember, type Members, type OtherMember } from "./members";
import { factorAt, positionOfFactor } from "./thumb";
import { formatValue } from "./units";
import type { ViewChange, ViewState } from "./view_state";

const kReaches = [1, 256] as const; // unit distances
const kParts = ["ambient", "head", "key", "highlight"] as const;
const kShadedModes: readonly string[] = ["blend", "first-hit", "iso"];
const kSamples = "16"; // rays a pixel, where a lens is asked for with one
const kApertures = 0.05; // of the distance to the target, the widest that is offered

export class LightControls {
  private readonly block = byId("light-block", HTMLElement);
  private readonly parts = kParts.map((name) => byId(`light-${name}`, HTMLInputElement));
  private readonly azimuth = byId("light-azimuth", HTMLInputElement);
  private readonly height = byId("light-height", HTMLInputElement);
  private readonly shadow = byId("shadow", HTMLInputElement);
  private readonly occlusion = byId("occlusion", HTMLInputElement);
  private readonly reach = byId("occlusion-reach", HTMLInputElement);
  private readonly lensBlock = byId("lens-block", HTMLElement);
  private readonly aperture = byId("aperture", HTMLInputElement);
  private readonly reset = byId("light-reset", HTMLButtonElement);
  private others: Members = {};
  private distance = 1; // of the target

  constructor(private readonly onChange: (change: ViewChange) => void) {
    for (const part of this.parts) part.addEventListener("input", () => this.say("light", this.parts.map(({ value }) => value).join(",")));
    const turn = (): void => this.say("key-light", directionText(Number(this.azimuth.value), Number(this.height.value)));
    this.azimuth.addEventListener("input", turn);
    this.height.addEventListener("input", turn);
    this.shadow.addEventListener("change", () => this.say("shadow", this.shadow.checked ? "on" : "off"));
    const occlude = (): void => this.say("occlusion", this.occlusion.checked ? String(factorAt(kReaches, Number(this.reach.value))) : "off");
    this.occlusion.addEventListener("change", occlude);
    this.reach.addEventListener("input", () => {
      if (this.occlusion.checked) occlude();
    });
    this.aperture.addEventListener("input", () => {
      const share = Number(this.aperture.value) / 1000;
      if (share === 0) return this.say("aperture", "0");
      const aperture = String(Number((share * kApertures * this.distance).toPrecision(2)));
      // One ray a pixel has no lens.
      const several = this.others.samples === undefined ? withMember(this.others, "samples", kSamples) : this.others;
      this.onChange({ others: withMember(several, "aperture", aperture) });
    });
    this.reset.addEventListener("click", () => {
      this.onChange({ others: kMembers.reduce<Members>((others, name) => withMember(others, name, undefined), this.others) });
    });
  }

  show(view: ViewState): void {
    this.others = view.others;
    const text = (name: OtherMember): string => view.others[name] ?? kOtherMembers[name];
    this.block.hidden = !view.lit || !kShadedModes.includes(view.mode);
    const strengths = text("light").split(",");
    this.parts.forEach((part, i) => {
      part.value = strengths[i] ?? "";
      part.setAttribute("aria-valuetext", formatValue(Number(strengths[i])));
    });
    const [x = -1, y = 1, z = 1] = text("key-light").split(",").map(Number);
    this.azimuth.value = String(Math.round((Math.atan2(x, z) * 180) / Math.PI));
    this.height.value = String(Math.round((Math.atan2(y, Math.hypot(x, z)) * 180) / Math.PI));
    this.azimuth.setAttribute("aria-valuetext", `${this.azimuth.value}°`);
    this.height.setAttribute("aria-valuetext", `${this.height.value}°`);
    this.shadow.checked = ["on", "true"].includes(text("shadow"));
    const reach = Number(text("occlusion")); // NaN: off
    this.occlusion.checked = reach > 0;
    this.reach.disabled = !(reach > 0);
    if (reach > 0) this.reach.value = String(positionOfFactor(kReaches, reach));
    this.reach.setAttribute("aria-valuetext", formatValue(reach > 0 ? reach : factorAt(kReaches, Number(this.reach.value))));
    this.distance = Math.hypot(...view.camera.target.map((at, axis) => at - (view.camera.eye[axis] ?? 0)));
    this.lensBlock.hidden = view.ortho !== null;
    const aperture = Number(text("aperture"));
    this.aperture.value = String(Math.round((1000 * aperture) / (kApertures * this.distance)));
    this.aperture.setAttribute("aria-valuetext", formatValue(aperture));
    this.reset.disabled = kMembers.every((name) => view.others[name] === undefined);
  }

  private say(name: OtherMember, text: string): void {
    this.onChange({ others: withMember(this.others, name, text) });
  }
}

const kMembers: readonly OtherMember[] = ["light", "key-light", "shadow", "occlusion", "aperture", "focus"];

// Degrees to the right of the eye and above it.
function directionText(azimuth: number, height: number): string {
  const [a, h] = [(azimuth * Math.PI) / 180, (height * Math.PI) / 180];
  const rounded = (value: number): string => String(Number(value.toFixed(4)) || 0);
  return [Math.sin(a) * Math.cos(h), Math.sin(h), Math.cos(a) * Math.cos(h)].map(rounded).join(",");
}
