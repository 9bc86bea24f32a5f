// SPDX-License-Identifier: Apache-2.0
// What a person chose of the page itself, for every volume: the browser remembers it, by name.

const kPrefix = "blockwalk.";

// Null where nothing is kept. A browser that keeps nothing for this page throws.
export function keptChoice(name: string): string | null {
  try {
    return localStorage.getItem(kPrefix + name);
  } catch {
    return null;
  }
}

export function keepChoice(name: string, value: string): void {
  try {
    localStorage.setItem(kPrefix + name, value);
  } catch {
    // it holds until the page is closed
  }
}
