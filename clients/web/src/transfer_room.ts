// SPDX-License-Identifier: Apache-2.0
// Room for transfer functions: what all channels' have in characters must fit a request's header beside the rest of a view.
// Functions that are too long have fewer points, evenly; labels have nothing between two points, so theirs stay whole.

import type { Problem } from "./protocol";
import { formatPoints, kMostPoints, parsePoints } from "./transfer";
import { resampled } from "./transfer_edit";
import type { ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

export const kMostTransferCharacters = 28 * 1024; // a header has 32 KiB
const kFewer = 0.95; // points, at each try

// The view as it can be sent. Where that takes more than fewer points, its functions are `before`.
export function roomed(view: ViewState, volume: Pick<VolumeInfo, "channels">, before: readonly string[]): { readonly view: ViewState; readonly problem: Problem | null } {
  const length = lengthOf(view.transfers);
  if (length <= kMostTransferCharacters) return { view, problem: null };
  const fits = thinned(view.transfers, volume);
  const transfers = fits ?? before;
  const fewer = transfers.flatMap((text, number) => (fits === null || text === view.transfers[number] ? [] : [`${volume.channels[number]?.name || `channel ${number}`} has ${parsePoints(text)?.length}`]));
  const done = fits === null ? "labels need each of their points, so nothing is changed." : `${fewer.join(", ")} points now, evenly.`;
  const detail = `The transfer functions of all channels take ${length} characters, and ${kMostTransferCharacters} can be sent: ${done}`;
  return { view: { ...view, transfers }, problem: { title: "The transfer functions are too long", detail, field: "tf" } };
}

const lengthOf = (transfers: readonly string[]): number => transfers.join(";").length;

// With as many points as there is room for, no function more than another. Null where none are few enough.
function thinned(transfers: readonly string[], { channels }: Pick<VolumeInfo, "channels">): readonly string[] | null {
  const points = transfers.map((text, number) => (channels[number]?.areLabels === true ? null : parsePoints(text)));
  for (let most = kMostPoints; most >= 2; most = Math.floor(most * kFewer)) {
    const fewer = transfers.map((text, number) => {
      const own = points[number] ?? [];
      return own.length > most ? formatPoints(resampled(own, most)) : text;
    });
    if (lengthOf(fewer) <= kMostTransferCharacters) return fewer;
  }
  return null;
}
