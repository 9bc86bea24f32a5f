// SPDX-License-Identifier: Apache-2.0
// What the server has been told of a view, member by member, so that each message has only what it does not know.
//
// A message that is refused leaves the server's view as it was: the member to blame is not sent again until it changes,
// the others are.

import type { ViewMembers } from "./protocol";

type Name = keyof ViewMembers;

export class SentMembers {
  private readonly told = new Map<Name, { readonly text: string; readonly id: number }>(); // the newest of each member
  private readonly open = new Map<number, readonly Name[]>(); // messages that may still be refused, by id

  // Those of the view's members that the server does not know.
  missing(view: ViewMembers): ViewMembers {
    return Object.fromEntries(namesOf(view).filter((name) => this.told.get(name)?.text !== JSON.stringify(view[name])).map((name) => [name, view[name]]));
  }

  sent(id: number, members: ViewMembers): void {
    const names = namesOf(members);
    for (const name of names) this.told.set(name, { text: JSON.stringify(members[name]), id });
    this.open.set(id, names);
  }

  // True when others than the member to blame are to be sent again. With nobody to blame they wait for the next change:
  // sent alone they would be refused alone.
  refused(id: number, blamed: string | null): boolean {
    const names = this.open.get(id) ?? [];
    this.open.delete(id);
    const lost = names.filter((name) => name !== blamed && this.told.get(name)?.id === id);
    for (const name of lost) this.told.delete(name);
    return lost.length > 0 && names.some((name) => name === blamed);
  }

  // A frame shows the view of this id: it and those before it were taken.
  taken(id: number): void {
    for (const earlier of this.open.keys()) if (earlier <= id) this.open.delete(earlier);
  }

  // Another connection, or another volume: nothing is known there.
  forget(): void {
    this.told.clear();
    this.open.clear();
  }
}

function namesOf(members: ViewMembers): readonly Name[] {
  return Object.keys(members) as Name[];
}
