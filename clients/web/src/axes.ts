// SPDX-License-Identifier: Apache-2.0
// Names of the world's directions, and the standard views along them: where a volume says what its axes are, the patient's.

import type { Vec3 } from "./vector";

export interface Side {
  readonly direction: Vec3; // outwards: the side that lies there is seen from there
  readonly name: string; // short, on the cube: +x, L
  readonly words: string; // right, left, x+
  readonly up: Vec3; // of the picture that looks at it
}

const kPairs: readonly (readonly [string, string])[] = [["right", "left"], ["anterior", "posterior"], ["superior", "inferior"]];
const kPlain: readonly (readonly [string, string])[] = [["+x", "−x"], ["+y", "−y"], ["+z", "−z"]];

// The six of them, + before - of each axis.
export function sidesOf(space: string | null, up: Vec3): readonly Side[] {
  const words = space === null ? null : patientWords(space);
  return [0, 1, 2].flatMap((axis) => [1, -1].map((sign) => {
    const direction: Vec3 = [axis === 0 ? sign : 0, axis === 1 ? sign : 0, axis === 2 ? sign : 0];
    const plain = kPlain[axis]?.[sign > 0 ? 0 : 1] ?? "";
    const said = words?.[axis]?.[sign > 0 ? 0 : 1];
    return { direction, name: said?.charAt(0).toUpperCase() ?? plain, words: said ?? plain, up: upFor(direction, words, up) };
  }));
}

// For each axis what lies towards its plus and its minus; null where the space is not the patient's.
function patientWords(space: string): readonly (readonly [string, string])[] | null {
  const items = /^[a-z]{3}$/i.test(space) ? [...space] : space.split("-").slice(0, 3);
  const axes = items.map((item) => {
    for (const [plus, minus] of kPairs) {
      for (const [towards, away] of [[plus, minus], [minus, plus]] as const) {
        if (item.toLowerCase() === towards || item.toLowerCase() === towards.charAt(0)) return [towards, away] as const;
      }
    }
    return null;
  });
  return axes.length === 3 && axes.every((axis) => axis !== null) ? axes : null;
}

// The head is up, in pictures from above and below the front; else it is the volume's own up.
function upFor(direction: Vec3, words: readonly (readonly [string, string])[] | null, own: Vec3): Vec3 {
  const towards = (word: string): Vec3 | null => {
    for (const [axis, pair] of (words ?? []).entries()) {
      const sign = pair[0] === word ? 1 : pair[1] === word ? -1 : 0;
      if (sign !== 0) return [axis === 0 ? sign : 0, axis === 1 ? sign : 0, axis === 2 ? sign : 0];
    }
    return null;
  };
  const isAlong = (a: Vec3): boolean => Math.abs(a[0] * direction[0] + a[1] * direction[1] + a[2] * direction[2]) > 0.9;
  const up = towards("superior") ?? own;
  if (!isAlong(up)) return up;
  const other = towards("anterior") ?? [0, 0, up[2] > 0.9 ? 0 : -1];
  return isAlong(other) || other.every((part) => part === 0) ? [0, 1, 0] : other;
}
