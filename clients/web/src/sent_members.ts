// SPDX-License-Identifier: Apache-2.0
// What the server has been told of a view, member by member, so that each message has only what it does not know.

import { kDefaults } from "./members";
import type { ViewMembers } from "./protocol";

export class SentMembers {
  private readonly told = new Map<string, string | null>(); // null: it was told something, but nobody knows whether it stands

  // Those of the view's members that the server does not know, and what takes back those that are no more in the view.
  missing(view: ViewMembers): ViewMembers {
    const members = Object.entries(view).filter(([name, value]) => this.told.get(name) !== JSON.stringify(value));
    for (const name of this.told.keys()) {
      const absent = kDefaults[name];
      if (!(name in view) && absent !== undefined && this.told.get(name) !== JSON.stringify(absent)) members.push([name, absent]);
    }
    return Object.fromEntries(members);
  }

  sent(members: ViewMembers): void {
    for (const [name, value] of Object.entries(members)) this.told.set(name, JSON.stringify(value));
    // Each takes the other's place.
    if ("fov" in members) this.told.delete("ortho");
    if ("ortho" in members) this.told.delete("fov");
  }

  // A message was refused, so the server kept what it had: all is said again.
  doubt(): void {
    for (const name of this.told.keys()) this.told.set(name, null);
  }

  // Another connection, or another volume: nothing is known there.
  forget(): void {
    this.told.clear();
  }
}
