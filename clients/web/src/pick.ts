// SPDX-License-Identifier: Apache-2.0
// What a pixel shows, as the server says it: a place in the volume and the values there.

import { Fields, FormatError, parseJson } from "./json_fields";
import { imageQuery } from "./url_state";
import type { Vec3 } from "./vector";
import type { ViewState } from "./view_state";

export interface Pick {
  readonly voxel: Vec3;
  readonly world: Vec3;
  readonly values: readonly (number | null)[]; // one a channel, data units; null where it is empty
}

// The query for a pixel of the view's picture, CSS pixels of an element of this size. Of modes that show no point, the
// first thing in the range.
export function pickQuery(view: ViewState, x: number, y: number, width: number, height: number, isColoured: boolean): string {
  const isExtreme = view.mode === "mip" || view.mode === "minip" || view.mode === "attenuated-mip";
  const hasPoint = view.mode === "blend" || view.mode === "first-hit" || view.mode === "iso" || (isExtreme && view.drawn.length === 1);
  const asked: ViewState = { ...view, mode: hasPoint ? view.mode : "first-hit", others: { ...view.others, samples: "1" } };
  const pixel = (at: number, length: number, side: number): number => Math.min(side - 1, Math.max(0, Math.floor((at / length) * side)));
  const query = imageQuery(asked, isColoured).replace(/&format=png$/, "");
  return `${query}&x=${pixel(x, width, view.size[0])}&y=${pixel(y, height, view.size[1])}`;
}

// Null where there is nothing under it, or no answer.
export async function fetchPick(address: string, signal: AbortSignal): Promise<Pick | null> {
  try {
    const response = await fetch(address, { signal });
    return response.ok ? parsePick(await response.text()) : null;
  } catch (error) {
    if (error instanceof DOMException || error instanceof TypeError || error instanceof FormatError) return null; // too late, or away
    throw error;
  }
}

export function parsePick(text: string): Pick | null {
  const fields = new Fields(parseJson(text, "pick"), "pick");
  if (!fields.boolean("hit")) return null;
  const values = fields.array("values").map((value) => (typeof value === "number" ? value : null));
  return { voxel: fields.vec3("voxel"), world: fields.vec3("world"), values };
}
