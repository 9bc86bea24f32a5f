// SPDX-License-Identifier: Apache-2.0
// What is asked of POST .../animate, and how far the zip that comes back is.

import { volumeOf, type Bookmark } from "./bookmarks";
import { textOfMembers } from "./members";
import { parseFragment } from "./url_state";
import type { Vec3 } from "./vector";
import { fitted, initialView, membersOf, ownCamera, type ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export const kMostFrames = 3600;
export const kMostKeys = 256;

export type Way = { readonly kind: "turn"; readonly axis: Vec3 | null } | { readonly kind: "bookmarks"; readonly views: readonly ViewState[] };

export interface AnimationOrder {
  readonly frames: number;
  readonly seconds: number;
  readonly format: "zip" | "webp";
  readonly way: Way;
}

// The pictures have the size, samples and background of `view`, which a turn turns.
export function animationBody({ frames, seconds, format, way }: AnimationOrder, view: ViewState, isColoured: boolean): object {
  const common = { frames, format, size: view.size, ...(format === "webp" && view.others.quality !== undefined && { quality: Number(view.others.quality) }) };
  if (way.kind === "turn") return { ...common, view: viewBody(view, isColoured), turntable: { seconds, ...(way.axis && { axis: way.axis }) } };
  const { samples } = view.others;
  const keys = way.views.map((key, i) => {
    const drawn = { ...key, others: textOfMembers({ ...key.others, ...(samples !== undefined && { samples }) }), background: isClear(view) ? `${key.background.slice(0, 6)}00` : key.background };
    return { seconds: (i * seconds) / Math.max(1, way.views.length - 1), view: viewBody(drawn, isColoured) };
  });
  return { ...common, keys };
}

// Those of this volume, in their order; what of one the volume has not is its own.
export function bookmarkedViews(bookmarks: readonly Bookmark[], volume: VolumeInfo, size: ViewState["size"]): readonly ViewState[] {
  return bookmarks.filter((bookmark) => volumeOf(bookmark) === volume.id).map((bookmark) => {
    const { change } = fitted(volume, parseFragment(bookmark.view).overrides, ownCamera(volume, size));
    return initialView(volume, size, change);
  });
}

const isClear = ({ background }: ViewState): boolean => background.length === 8 && background.endsWith("00");

function viewBody(view: ViewState, isColoured: boolean): object {
  const { size: _, quality: __, ...members } = membersOf({ ...view, others: { ...view.others, quality: undefined } }, isColoured) as Record<string, unknown>;
  return members;
}

const kLocalBytes = 30;
const kLocalSign = 0x04034b50;

// Counts entries of a zip of stored ones as its bytes come (APPNOTE.TXT 4.3.7).
export class ZipCount {
  entries = 0; // that are whole
  private readonly head = new DataView(new ArrayBuffer(kLocalBytes));
  private headBytes = 0;
  private skip = 0; // of the entry that is read: its name and bytes
  private isOver = false; // the directory follows

  add(bytes: Uint8Array): void {
    for (let at = 0; at < bytes.length && !this.isOver; ) {
      if (this.skip > 0) {
        const passed = Math.min(this.skip, bytes.length - at);
        at += passed;
        this.skip -= passed;
        if (this.skip === 0) this.entries++;
        continue;
      }
      this.head.setUint8(this.headBytes++, bytes[at++] ?? 0);
      if (this.headBytes === 4) this.isOver = this.head.getUint32(0, true) !== kLocalSign;
      if (this.headBytes < kLocalBytes) continue;
      this.skip = this.head.getUint32(18, true) + this.head.getUint16(26, true) + this.head.getUint16(28, true);
      this.headBytes = 0;
    }
  }
}
