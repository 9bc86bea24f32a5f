// SPDX-License-Identifier: Apache-2.0
// Whether single keys do something: who dictates, or types blindly, may want none of them. The browser remembers it.

import { byId } from "./dom";

const kStored = "blockwalk.single-keys";

export class KeyChoice {
  private readonly input = byId("single-keys", HTMLInputElement);

  constructor() {
    this.input.checked = stored() !== "off";
    this.input.addEventListener("change", () => store(this.input.checked ? "on" : "off"));
  }

  get areOn(): boolean {
    return this.input.checked;
  }
}

// A browser that keeps nothing for this page throws.
function stored(): string | null {
  try {
    return localStorage.getItem(kStored);
  } catch {
    return null;
  }
}

function store(value: string): void {
  try {
    localStorage.setItem(kStored, value);
  } catch {
    // it holds until the page is closed
  }
}
