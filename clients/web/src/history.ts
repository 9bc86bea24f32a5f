// SPDX-License-Identifier: Apache-2.0
// The views to go back to. Changes of the same members are one step where they follow each other closely, as those of a
// held key do, or come while a pointer is held, however slow the page is; those of one gesture may rest between two, as a
// hand does at a wheel. What is added or taken away is one by itself.

import { withMember } from "./members";
import type { ViewState } from "./view_state";

const kPauseMs = 400;
const kRestMs = 2500; // in a gesture
const kMostSteps = 100;
const kLists: readonly (keyof ViewState)[] = ["drawn", "transfers", "planes", "marks"];

export class ViewHistory {
  private before: ViewState[] = [];
  private after: ViewState[] = [];
  private settled: ViewState | null = null; // what the next step goes back to
  private changedAt = -Infinity;
  private changedWhat = "";
  private changedBy = ""; // the gesture
  private isPressed = false;
  private changedInPress = false;

  // A pointer went down, or all are up again.
  press(isPressed: boolean): void {
    [this.isPressed, this.changedInPress] = [isPressed, false];
  }

  // A person's change made this view, at this time in milliseconds. `gesture`: what it is a part of, such as a scroll; empty: nothing.
  changed(view: ViewState, now: number, gesture = ""): void {
    const last = this.settled;
    const what = last === null ? "" : difference(last, view);
    const follows = (this.isPressed && this.changedInPress) || now - this.changedAt < (gesture === "" ? kPauseMs : kRestMs);
    const isStep = !follows || gesture !== this.changedBy || (gesture === "" && what !== this.changedWhat);
    if (last !== null && what !== "" && isStep) {
      this.before = [...this.before, last].slice(-kMostSteps);
      this.after = [];
    }
    if (what !== "") [this.changedAt, this.changedWhat, this.changedBy, this.changedInPress] = [now, what, gesture, this.isPressed];
    this.settled = view;
  }

  // The server takes none of these, and `view` is shown instead: nothing goes back or forth to them, nor to what is shown now.
  refused(refused: readonly ViewState[], view: ViewState): void {
    const isTaken = (other: ViewState): boolean => refused.every((gone) => difference(gone, other) !== "");
    const untilOther = (views: readonly ViewState[]): ViewState[] => {
      const last = views.at(-1);
      return last === undefined || difference(last, view) !== "" ? [...views] : untilOther(views.slice(0, -1));
    };
    const steps = this.before.length;
    [this.before, this.after] = [untilOther(this.before.filter(isTaken)), untilOther(this.after.filter(isTaken))];
    this.settled = view;
    // What a person goes on with is a step again where that to the refused view is gone.
    if (this.before.length < steps) [this.changedAt, this.changedInPress] = [-Infinity, false];
  }

  // Null where nothing lies that way.
  step(way: "back" | "forth"): ViewState | null {
    const [from, to] = way === "back" ? [this.before, this.after] : [this.after, this.before];
    const view = from.pop();
    if (view === undefined) return null;
    if (this.settled !== null) to.push(this.settled);
    this.settled = view;
    this.changedAt = -Infinity;
    return view;
  }

  has(way: "back" | "forth"): boolean {
    return (way === "back" ? this.before : this.after).length > 0;
  }

  // Another volume: its view is where it begins.
  begin(view: ViewState): void {
    [this.before, this.after, this.settled, this.changedAt] = [[], [], view, -Infinity];
  }
}

// The names of what differs, and of lists of how many items they are before and after, but for the window's size and the
// step in time, which is played: they are nobody's step.
function difference(a: ViewState, b: ViewState): string {
  const names = Object.keys(b) as (keyof ViewState)[];
  const timeless = (name: keyof ViewState, view: ViewState): string => JSON.stringify(name === "others" ? withMember(view.others, "time", undefined) : view[name]);
  const items = (name: keyof ViewState, view: ViewState): number => timeless(name, view).split(",").length;
  return names
    .filter((name) => name !== "size" && timeless(name, a) !== timeless(name, b))
    .map((name) => (kLists.includes(name) ? `${name} ${items(name, a)} ${items(name, b)}` : name))
    .join();
}
