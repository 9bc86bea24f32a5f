// SPDX-License-Identifier: Apache-2.0
// What a press on a picture does: moves it, moves the crosshair, or sets the next point of a mark that is being made.

import { kPointCounts, type Mark, type MarkKind } from "./marks";
import type { Vec3 } from "./vector";

export type Tool = "move" | "crosshair" | MarkKind;
export const kTools: readonly Tool[] = ["move", "crosshair", "ruler", "angle", "line", "area", "point", "box", "text"];
export const kMarkColours = ["ffb454", "7fd1c4", "ff8fa3", "8fb8ff", "c8e66e", "d9a0ff"];

export class MarkTool {
  tool: Tool = "crosshair";
  private points: readonly Vec3[] = []; // set so far
  private where = ""; // the picture they were set in
  private hovered: Vec3 | null = null;

  // `made`: a mark is complete, without its colour; `changed`: what is being made looks different.
  constructor(private readonly made: (kind: MarkKind, points: readonly Vec3[]) => void, private readonly changed: () => void) {}

  get kind(): MarkKind | null {
    return this.tool === "move" || this.tool === "crosshair" ? null : this.tool;
  }

  // As far as it is made, with the point that would be next; null where none is.
  get pending(): Pick<Mark, "kind" | "points"> | null {
    const { kind } = this;
    if (kind === null || this.points.length === 0) return null;
    return { kind, points: this.hovered === null ? this.points : [...this.points, this.hovered] };
  }

  get isEmpty(): boolean {
    return this.points.length === 0;
  }

  choose(tool: Tool): void {
    this.tool = tool;
    this.cancel();
  }

  // A measure lies in one picture: a point in another begins anew.
  set(point: Vec3, where: string): void {
    const { kind } = this;
    if (kind === null) return;
    if (where !== this.where) this.points = [];
    this.where = where;
    this.points = [...this.points, point];
    if (this.points.length >= kPointCounts[kind][1]) this.finish();
    else this.changed();
  }

  hover(point: Vec3 | null, where: string): void {
    if (this.points.length === 0 || where !== this.where) return;
    this.hovered = point;
    this.changed();
  }

  // Whether there was a mark to finish. A double click has set the same point twice.
  finish(isDouble = false): boolean {
    const { kind } = this;
    if (kind === null || this.points.length === 0) return false;
    const points = isDouble ? this.points.slice(0, -1) : this.points;
    if (points.length < kPointCounts[kind][0]) return false;
    this.forget();
    this.made(kind, points);
    return true;
  }

  // Whether there was something to leave.
  cancel(): boolean {
    const had = this.points.length > 0;
    this.forget();
    this.changed();
    return had;
  }

  private forget(): void {
    this.points = [];
    this.hovered = null;
  }
}
