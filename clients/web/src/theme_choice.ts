// SPDX-License-Identifier: Apache-2.0
// Dark or light: as the system has it, or as was chosen, which the browser remembers. The colours are style.css's.

import { byId, part } from "./dom";
import { keepChoice, keptChoice } from "./kept_choice";

const kName = "theme";
const kThemes: readonly string[] = ["system", "dark", "light"];
const kSystemIsLight = window.matchMedia("(prefers-color-scheme: light)");

export class ThemeChoice {
  private readonly select = byId("theme", HTMLSelectElement);
  private readonly frame = part(document, "meta[name=theme-color]", HTMLMetaElement); // what a phone paints around the page

  constructor() {
    const kept = keptChoice(kName) ?? "";
    this.select.value = kThemes.includes(kept) ? kept : "system";
    this.select.addEventListener("change", () => {
      keepChoice(kName, this.select.value);
      this.apply();
    });
    kSystemIsLight.addEventListener("change", () => this.apply());
    this.apply();
  }

  private apply(): void {
    const root = document.documentElement;
    if (this.select.value === "system") delete root.dataset["theme"];
    else root.dataset["theme"] = this.select.value;
    this.frame.content = getComputedStyle(byId("panel", HTMLElement)).backgroundColor;
  }
}
