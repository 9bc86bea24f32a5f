// SPDX-License-Identifier: Apache-2.0
// Live figures: frames and bytes over the last second, and the time from a view's sending to its first frame.

export interface Figures {
  readonly framesPerSecond: number;
  readonly bytesPerSecond: number;
  readonly latencyMs: number | null; // null until a view was answered
}

const kWindowMs = 1000;
const kMostPending = 256; // views without an answer; older ones were skipped by the server

export class Meter {
  private readonly sentAt = new Map<number, number>();
  private arrivals: { readonly at: number; readonly bytes: number }[] = [];
  private latencyMs: number | null = null;

  viewSent(id: number, now: number): void {
    this.sentAt.set(id, now);
    if (this.sentAt.size > kMostPending) {
      const oldest = this.sentAt.keys().next();
      if (!oldest.done) this.sentAt.delete(oldest.value);
    }
  }

  // `id` is the newest view the frame shows; refinements of a view already answered leave the latency alone.
  frameArrived(id: number, bytes: number, now: number): void {
    const sent = this.sentAt.get(id);
    if (sent !== undefined) this.latencyMs = now - sent;
    for (const pending of this.sentAt.keys()) {
      if (pending <= id) this.sentAt.delete(pending);
    }
    this.arrivals.push({ at: now, bytes });
  }

  figures(now: number): Figures {
    this.arrivals = this.arrivals.filter((arrival) => now - arrival.at < kWindowMs);
    const perSecond = 1000 / kWindowMs;
    return {
      framesPerSecond: this.arrivals.length * perSecond,
      bytesPerSecond: this.arrivals.reduce((sum, arrival) => sum + arrival.bytes, 0) * perSecond,
      latencyMs: this.latencyMs,
    };
  }

  // A new connection: what was sent on the old one is never answered.
  reset(): void {
    this.sentAt.clear();
    this.latencyMs = null;
  }
}
