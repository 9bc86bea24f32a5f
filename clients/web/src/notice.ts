// SPDX-License-Identifier: Apache-2.0
// What covers the picture while there is none to show: a pure choice from the states of list, choice and stream.

import type { CatalogState } from "./catalog";
import type { Problem } from "./protocol";

export type StreamState = "none" | "connecting" | "live" | "lost";

export interface Notice {
  readonly kind: "busy" | "empty" | "failed";
  readonly title: string;
  readonly detail: string;
}

// `refusal`: why the newest attempt at a stream was refused; null when it was not, or nobody knows.
export function noticeFor(catalog: CatalogState, chosen: string | null, stream: StreamState, refusal: Problem | null): Notice | null {
  if (stream === "live") return null;
  if (catalog.kind === "refused") return { kind: "failed", title: "The server wants a token", detail: catalog.reason };
  if (catalog.kind === "unreachable" && stream === "lost") return kReconnecting;
  if (catalog.kind === "unreachable") return { kind: "busy", title: "Connecting…", detail: catalog.reason };
  if (catalog.kind === "unknown") return { kind: "busy", title: "Connecting…", detail: "" };
  if (catalog.volumes.length === 0) {
    return {
      kind: "empty",
      title: "No volumes yet",
      detail: "Bring your own with “blockwalk import scan.nrrd -o scan.bwv”, or make one with “blockwalk demo fossil -o scan.bwv”, and start “blockwalkd scan.bwv”.",
    };
  }
  const volume = catalog.volumes.find((candidate) => candidate.id === chosen);
  if (volume === undefined) {
    return { kind: "failed", title: `No volume “${chosen ?? ""}” here`, detail: "Choose another from the list." };
  }
  if (volume.state === "loading") {
    return { kind: "busy", title: `Loading ${volume.name}…`, detail: "It appears here as soon as it is ready." };
  }
  if (volume.state === "failed") {
    return { kind: "failed", title: `${volume.name} could not be loaded`, detail: volume.error ?? "" };
  }
  if (refusal !== null) return { kind: "busy", title: refusal.title, detail: sentences(refusal.detail, "Trying again…") };
  return stream === "lost" ? kReconnecting : { kind: "busy", title: "Connecting…", detail: "" };
}

const kReconnecting: Notice = {
  kind: "busy",
  title: "Reconnecting…",
  detail: "The server is away. The view is kept.",
};

function sentences(detail: string, next: string): string {
  return detail === "" ? next : `${detail.charAt(0).toUpperCase()}${detail.slice(1)}. ${next}`;
}
