// SPDX-License-Identifier: Apache-2.0
// The planes that cut, up to as many as the server takes: each along an axis or as one looks, with its place and its side.

import { byId, part } from "./dom";
import { formatIn } from "./units";
import { add, dot, length, normalize, scale, type Vec3 } from "./vector";
import { kMostPlanes } from "./url_state";
import type { Plane } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kSteps = 500; // of a slider

export class PlaneList {
  private readonly list = byId("planes", HTMLElement);
  private readonly template = byId("plane-row", HTMLTemplateElement);
  private readonly addButton = byId("plane-add", HTMLButtonElement);
  private volume: VolumeInfo | null = null;
  private planes: readonly Plane[] = [];

  // `forward` is where the camera looks.
  constructor(private readonly onChange: (planes: readonly Plane[]) => void, private readonly forward: () => Vec3 | null) {
    this.addButton.addEventListener("click", () => {
      const plane = this.through("view");
      if (plane === null || this.planes.length >= kMostPlanes) return;
      this.onChange([...this.planes, plane]);
      this.list.lastElementChild?.querySelector<HTMLElement>("select")?.focus();
    });
  }

  setVolume(volume: VolumeInfo): void {
    this.volume = volume;
    this.planes = [];
    this.list.replaceChildren();
  }

  show(planes: readonly Plane[]): void {
    this.planes = planes;
    while (this.list.childElementCount > planes.length) this.list.lastElementChild?.remove();
    while (this.list.childElementCount < planes.length) this.list.append(this.row(this.list.childElementCount));
    [...this.list.children].forEach((row, index) => {
      const plane = planes[index];
      if (plane === undefined) return;
      part(row, "select", HTMLSelectElement).value = axisOf(plane);
      const slider = part(row, "input", HTMLInputElement);
      const place = this.placeOf(plane);
      slider.value = String(Math.round(kSteps * place));
      const text = this.placeText(plane);
      slider.setAttribute("aria-valuetext", text);
      part(row, "output", HTMLOutputElement).textContent = text;
    });
    this.addButton.disabled = planes.length >= kMostPlanes;
    this.addButton.title = this.addButton.disabled ? `There are ${kMostPlanes}: no more may be (planes)` : "Through the middle, what is nearer cut away (planes)";
  }

  private row(index: number): DocumentFragment {
    const copy = this.template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template's copy is a fragment");
    const name = `Plane ${index + 1}`;
    part(copy, ".plane", HTMLElement).setAttribute("aria-label", name);
    const normal = part(copy, "select", HTMLSelectElement);
    normal.setAttribute("aria-label", `Direction of ${name.toLowerCase()}`);
    normal.addEventListener("change", () => {
      const plane = this.through(normal.value);
      if (plane !== null) this.replace(index, plane);
    });
    const slider = part(copy, "input", HTMLInputElement);
    slider.setAttribute("aria-label", `Place of ${name.toLowerCase()}`);
    slider.addEventListener("input", () => this.move(index, Number(slider.value) / kSteps));
    const flip = part(copy, ".plane-flip", HTMLButtonElement);
    flip.setAttribute("aria-label", `Flip ${name.toLowerCase()}`);
    flip.addEventListener("click", () => {
      const own = this.planes[index];
      if (own !== undefined) this.replace(index, [-own[0], -own[1], -own[2], -own[3]]);
    });
    const remove = part(copy, ".plane-remove", HTMLButtonElement);
    remove.setAttribute("aria-label", `Remove ${name.toLowerCase()}`);
    remove.addEventListener("click", () => {
      this.onChange(this.planes.filter((_, other) => other !== index));
      (this.list.children[Math.min(index, this.list.childElementCount - 1)]?.querySelector<HTMLElement>(".plane-remove") ?? this.addButton).focus();
    });
    return copy;
  }

  private replace(index: number, plane: Plane): void {
    this.onChange(this.planes.map((other, i) => (i === index ? plane : other)));
  }

  // Through the middle of the volume: along an axis, or facing who looks.
  private through(direction: string): Plane | null {
    const axis = "xyz".indexOf(direction);
    const way = axis >= 0 ? ([0, 1, 2].map((a) => (a === axis ? 1 : 0)) as [number, number, number]) : direction === "view" ? this.forward() : null;
    if (way === null || this.volume === null) return null;
    const [x, y, z] = normalize(way).map((part) => Number(part.toFixed(4)));
    const normal: Vec3 = [x ?? 0, y ?? 0, z ?? 1];
    const { min, max } = this.volume.worldBox;
    return [...normal, 0 - Number(dot(normal, scale(add(min, max), 0.5)).toPrecision(9))];
  }

  // 0 where it lies before all of the volume, 1 behind; along an axis the same way from either side.
  private placeOf(plane: Plane): number {
    const [near, far] = this.reach(plane);
    const share = far > near ? (-plane[3] - near) / (far - near) : 0.5;
    return isBackward(plane) ? 1 - share : share;
  }

  // Along an axis where it crosses it, otherwise how far into the volume.
  private placeText(plane: Plane): string {
    const [near, far] = this.reach(plane);
    const size = length([plane[0], plane[1], plane[2]]);
    const unit = this.volume?.lengthUnit ?? null;
    const axis = axisOf(plane);
    const value = axis === "own" ? (-plane[3] - near) / size : -plane[3] / (plane["xyz".indexOf(axis)] ?? 1);
    return `${formatIn(Number(value.toPrecision(6)), (far - near) / size)}${unit === null ? "" : ` ${unit}`}`;
  }

  private move(index: number, share: number): void {
    const own = this.planes[index];
    if (own === undefined) return;
    const [near, far] = this.reach(own);
    const place = isBackward(own) ? 1 - share : share;
    this.replace(index, [own[0], own[1], own[2], 0 - Number((near + place * (far - near)).toPrecision(7))]);
  }

  // Of the volume along the plane's normal.
  private reach([x, y, z]: Plane): readonly [number, number] {
    const { min, max } = this.volume?.worldBox ?? { min: [0, 0, 0], max: [1, 1, 1] };
    const normal = [x, y, z];
    const side = (far: boolean): number => normal.reduce((sum, n, axis) => sum + n * ((n > 0 === far ? max[axis] : min[axis]) ?? 0), 0);
    return [side(false), side(true)];
  }
}

function axisOf([x, y, z]: Plane): "x" | "y" | "z" | "own" {
  const parts = [x, y, z];
  const along = parts.findIndex((part) => part !== 0);
  return parts.filter((part) => part !== 0).length === 1 ? (["x", "y", "z"] as const)[along] ?? "own" : "own";
}

// Against the axis it goes along.
const isBackward = (plane: Plane): boolean => axisOf(plane) !== "own" && plane.slice(0, 3).some((part) => part < 0);
