// SPDX-License-Identifier: Apache-2.0
// The views that volumes had when another was chosen. While the page is open they are kept as they are; for a page that is
// loaded again, as addresses in the tab's storage, the newest of them.

import { FormatError, parseJson } from "./json_fields";
import type { ViewState } from "./view_state";

export type TabStorage = Pick<Storage, "getItem" | "setItem">;
type Entry = readonly [id: string, address: string];

const kStored = "blockwalk.views";
export const kMostViews = 64;
export const kMostViewCharacters = 512 * 1024; // in all

export class KeptViews {
  private readonly views = new Map<string, ViewState>();

  // `storage` is null, or throws, where the browser keeps nothing for this page.
  constructor(private readonly storage: TabStorage | null) {}

  keep(id: string, view: ViewState, address: string): void {
    this.views.set(id, view);
    const entries = [...this.stored().filter(([other]) => other !== id), [id, address] as const];
    while (entries.length > kMostViews || JSON.stringify(entries).length > kMostViewCharacters) entries.shift();
    try {
      this.storage?.setItem(kStored, JSON.stringify(entries));
    } catch {
      // it holds until the page is closed
    }
  }

  // Of this page.
  viewOf(id: string): ViewState | null {
    return this.views.get(id) ?? null;
  }

  // Of a page before it in this tab.
  addressOf(id: string): string | null {
    return this.stored().find(([other]) => other === id)?.[1] ?? null;
  }

  // The oldest first; what is none is left out.
  private stored(): readonly Entry[] {
    try {
      const value = parseJson(this.storage?.getItem(kStored) ?? "[]", "views");
      return Array.isArray(value) ? value.filter(isEntry) : [];
    } catch (error) {
      if (error instanceof FormatError || error instanceof DOMException) return [];
      throw error;
    }
  }
}

function isEntry(value: unknown): value is Entry {
  return Array.isArray(value) && value.length === 2 && value.every((part) => typeof part === "string");
}

// Null where the browser refuses it.
export function tabStorage(): TabStorage | null {
  try {
    return window.sessionStorage;
  } catch {
    return null;
  }
}
