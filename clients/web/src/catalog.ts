// SPDX-License-Identifier: Apache-2.0
// The list of volumes, asked again while it can change by itself: a volume loads, the server is away, nothing is served.

import { FormatError, Fields, parseJson } from "./json_fields";
import { parseProblem } from "./protocol";
import { parseVolumeList, type VolumeSummary } from "./volume_info";

export type CatalogState =
  | { readonly kind: "unknown" }
  | { readonly kind: "known"; readonly volumes: readonly VolumeSummary[] }
  | { readonly kind: "refused"; readonly reason: string } // the server is there but wants a token
  | { readonly kind: "unreachable"; readonly reason: string };

const kLoadingPauseMs = 700;
const kAwayPauseMs = 1500;
const kEmptyPauseMs = 3000;
const kAnswerTimeoutMs = 10000;

export class Catalog {
  private timer: number | undefined;
  private asking = false;

  constructor(
    private readonly address: string,
    private readonly onChange: (state: CatalogState) => void,
  ) {}

  // Asks now, unless an answer is already on its way.
  async refresh(): Promise<void> {
    if (this.asking) return;
    this.asking = true;
    window.clearTimeout(this.timer);
    const state = await fetchList(this.address);
    this.asking = false;
    const pause = pauseAfter(state);
    if (pause !== null) this.timer = window.setTimeout(() => void this.refresh(), pause);
    this.onChange(state);
  }
}

async function fetchList(address: string): Promise<CatalogState> {
  try {
    const response = await fetch(address, { cache: "no-store", signal: AbortSignal.timeout(kAnswerTimeoutMs) });
    const body = parseJson(await response.text(), "list");
    if (response.ok) return { kind: "known", volumes: parseVolumeList(body) };
    const problem = parseProblem(new Fields(body, "problem"));
    const isRefused = response.status === 401 || response.status === 403;
    return { kind: isRefused ? "refused" : "unreachable", reason: problem.detail || problem.title };
  } catch (error) {
    // A refused connection, a timeout, or an answer that is no list: all mean "not now", and the reason is shown.
    const reason = error instanceof FormatError || error instanceof DOMException ? error.message : "No answer";
    return { kind: "unreachable", reason };
  }
}

function pauseAfter(state: CatalogState): number | null {
  if (state.kind !== "known") return kAwayPauseMs;
  if (state.volumes.length === 0) return kEmptyPauseMs;
  return state.volumes.some((volume) => volume.state === "loading") ? kLoadingPauseMs : null;
}
