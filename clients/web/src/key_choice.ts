// SPDX-License-Identifier: Apache-2.0
// Whether single keys do something: who dictates, or types blindly, may want none of them. The browser remembers it.

import { byId } from "./dom";
import { keepChoice, keptChoice } from "./kept_choice";

const kName = "single-keys";

export class KeyChoice {
  private readonly input = byId("single-keys", HTMLInputElement);

  constructor() {
    this.input.checked = keptChoice(kName) !== "off";
    this.input.addEventListener("change", () => keepChoice(kName, this.input.checked ? "on" : "off"));
  }

  get areOn(): boolean {
    return this.input.checked;
  }
}
