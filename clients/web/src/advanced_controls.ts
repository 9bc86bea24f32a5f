// SPDX-License-Identifier: Apache-2.0
// What few people need: level, rays a pixel, step, finder. Each select is a member of the view of the same name.

import { byId, element } from "./dom";
import { isOtherMember, kOtherMembers, withMember, type OtherMember } from "./members";
import type { VolumeInfo } from "./volume_info";
import type { ViewChange, ViewState } from "./view_state";

export class AdvancedControls {
  private readonly fold = byId("advanced", HTMLDetailsElement);
  private readonly selects: ReadonlyMap<OtherMember, HTMLSelectElement>;
  private view: ViewState | null = null;

  constructor(private readonly onChange: (change: ViewChange) => void) {
    const all = [...this.fold.querySelectorAll("select")];
    this.selects = new Map(all.flatMap((select) => (isOtherMember(select.name) ? [[select.name, select] as const] : [])));
    for (const [name, select] of this.selects) {
      select.addEventListener("change", () => {
        if (this.view !== null) this.onChange({ others: withMember(this.view.others, name, select.value) });
      });
    }
  }

  setVolume({ levelCount }: VolumeInfo): void {
    this.view = null;
    const levels = Array.from({ length: levelCount }, (_, level) => element("option", { value: String(level) }, level === 0 ? "0, the finest" : String(level)));
    this.selects.get("level")?.replaceChildren(element("option", { value: "auto" }, "As fine as seen"), ...levels);
  }

  // What an address asked for may be none of the choices: it becomes one. The fold opens where something in it is not as usual.
  show(view: ViewState): void {
    const isFirst = this.view === null;
    this.view = view;
    for (const [name, select] of this.selects) {
      const text = view.others[name] ?? kOtherMembers[name];
      if (![...select.options].some((option) => option.value === text)) select.append(element("option", { value: text }, text));
      select.value = text;
    }
    const isUnusual = view.mode === "blocks" || [...this.selects.keys()].some((name) => view.others[name] !== undefined);
    if (isFirst && isUnusual) this.fold.open = true;
  }
}
