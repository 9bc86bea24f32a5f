// SPDX-License-Identifier: Apache-2.0
// Which views the server has taken, so that one it refuses never stays on the screen.
//
// A view is taken when a frame shows it. When one is refused, those sent after it stand on what never was: none of them
// counts, and the view becomes what was taken last, or only the member to blame does where that makes a difference.

import { isOtherMember, withMember } from "./members";
import { membersOf, type ViewChange, type ViewState } from "./view_state";

const kPlaces: Readonly<Record<string, readonly (keyof ViewState)[]>> = {
  size: ["size"], eye: ["camera"], target: ["camera"], up: ["camera"], fov: ["fovDegrees", "ortho"], ortho: ["fovDegrees", "ortho"],
  channels: ["drawn"], range: ["ranges"], mode: ["mode"], iso: ["iso"], filter: ["filter"], lit: ["lit"], extinction: ["extinction"],
  tf: ["transfers"], clip: ["clip"], planes: ["planes"], background: ["background"],
};

export class AcceptedViews {
  private readonly open = new Map<number, ViewState>(); // sent, neither taken nor refused, by id
  private last: ViewState | null = null;
  private newest = 0;
  private settled = 0; // what was sent up to this id stands on a view that was refused

  get current(): ViewState | null {
    return this.last;
  }

  // The view of this id, where it is neither taken nor refused.
  sentAs(id: number): readonly ViewState[] {
    const view = this.open.get(id);
    return view === undefined ? [] : [view];
  }

  sent(id: number, view: ViewState): void {
    this.open.set(id, view);
    this.newest = id;
  }

  // A frame shows the view of this id.
  taken(id: number): void {
    for (const [earlier, view] of this.open) {
      if (earlier > id) continue;
      this.last = view;
      this.open.delete(earlier);
    }
  }

  // The view to show instead of `view`, where the server refuses the one of this id; `own` is what it takes for certain.
  // Null where there is nothing to go back to, or the way back was taken already.
  refused(id: number, field: string | null, view: ViewState, own: ViewState): ViewState | null {
    if (id <= this.settled) return null;
    this.settled = this.newest;
    this.open.clear();
    const back = this.last ?? own;
    const one = { ...view, ...memberOf(back, view, field) };
    if (!areEqual(one, view)) return one;
    const whole = { ...back, size: view.size };
    return areEqual(whole, view) ? null : whole;
  }

  // Another connection knows nothing yet; another volume none of this one's views.
  forget(isOther: boolean): void {
    this.open.clear();
    this.settled = this.newest;
    if (isOther) this.last = null;
  }
}

// What the member of this name is in `from`, as a change of `view`.
function memberOf(from: ViewState, view: ViewState, field: string | null): ViewChange {
  if (field !== null && isOtherMember(field)) return { others: withMember(view.others, field, from.others[field]) };
  const places = (field === null ? undefined : kPlaces[field]) ?? [];
  return Object.fromEntries(places.map((place) => [place, from[place]]));
}

const areEqual = (a: ViewState, b: ViewState): boolean => JSON.stringify(membersOf(a, true)) + a.transfers.join() === JSON.stringify(membersOf(b, true)) + b.transfers.join();
