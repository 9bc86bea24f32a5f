// SPDX-License-Identifier: Apache-2.0
// Pictures of slices: one request at a time, for what is wanted most; what is wanted no more is abandoned. What came is kept,
// up to a bound, and beyond it what is wished for now: to drop that would be to ask for it again, without end.

import { Fields, FormatError, parseJson } from "./json_fields";
import type { Problem } from "./protocol";

export const kMostBytes = 64 * 1024 * 1024; // of pixels that are kept
const kMostRefusals = 64;
const kBusyMs = 700; // until a server that had no time is asked again; it doubles
const kLongestPauseMs = 5000;
const kToldAttempts = 8;

export class SliceSource {
  private readonly pictures = new Map<string, ImageBitmap>(); // the one used last is the last
  private readonly refused = new Set<string>();
  private bytes = 0;
  private wishes: readonly string[] = []; // the most wanted first
  private ahead: readonly string[] = []; // as large as the first wish
  private underway: { readonly address: string; readonly stop: AbortController } | null = null;
  private attempt: { readonly address: string; readonly count: number } | null = null; // that nobody had time for
  private timer: number | undefined;

  constructor(private readonly onPicture: () => void, private readonly onProblem: (problem: Problem) => void) {}

  get(address: string): ImageBitmap | null {
    const picture = this.pictures.get(address);
    if (picture === undefined) return null;
    this.pictures.delete(address);
    this.pictures.set(address, picture);
    return picture;
  }

  // `ahead`: what is fetched before it is wanted, where there is room beside the wishes.
  wish(addresses: readonly string[], ahead: readonly string[] = []): void {
    [this.wishes, this.ahead] = [addresses, ahead];
    if (this.underway !== null && !this.isWished(this.underway.address)) {
      this.underway.stop.abort();
      this.underway = null;
    }
    this.next();
  }

  // Another volume, or none.
  clear(): void {
    this.wish([]);
    window.clearTimeout(this.timer);
    for (const picture of this.pictures.values()) picture.close();
    this.pictures.clear();
    this.refused.clear();
    this.attempt = null;
    this.bytes = 0;
  }

  private isWished(address: string): boolean {
    return this.wishes.includes(address) || this.ahead.includes(address);
  }

  private next(): void {
    if (this.underway !== null) return;
    const isMissing = (wanted: string): boolean => !this.pictures.has(wanted) && !this.refused.has(wanted);
    const address = this.wishes.find(isMissing) ?? (this.hasRoomAhead() ? this.ahead.find(isMissing) : undefined);
    if (address === undefined) return;
    const stop = new AbortController();
    this.underway = { address, stop };
    void this.fetch(address, stop.signal);
  }

  private hasRoomAhead(): boolean {
    const sizeOf = (address: string): number => {
      const picture = this.pictures.get(address);
      return picture === undefined ? 0 : bytesOf(picture);
    };
    const held = [...new Set([...this.wishes, ...this.ahead])].reduce((sum, address) => sum + sizeOf(address), 0);
    return held + sizeOf(this.wishes[0] ?? "") <= kMostBytes;
  }

  private async fetch(address: string, signal: AbortSignal): Promise<void> {
    try {
      const response = await fetch(address, { signal });
      // What is the server's or a proxy's fault passes.
      if (response.status === 429 || response.status >= 500) return this.retry(address, signal);
      if (!response.ok) return this.refuse(address, signal, problemOf(response.status, await response.text()));
      const picture = await createImageBitmap(await response.blob(), { colorSpaceConversion: "none" });
      if (signal.aborted) return picture.close();
      this.attempt = null;
      this.keep(address, picture);
    } catch (error) {
      if (signal.aborted) return;
      // Away: the stream reconnects too.
      if (error instanceof TypeError) return this.retry(address, signal);
      this.refuse(address, signal, { title: "A slice could not be shown", detail: error instanceof Error ? error.message : String(error), field: null });
      return;
    }
    this.underway = null;
    this.onPicture();
    this.next();
  }

  private keep(address: string, picture: ImageBitmap): void {
    this.pictures.set(address, picture);
    this.bytes += bytesOf(picture);
    for (const [oldest, old] of this.pictures) {
      if (this.bytes <= kMostBytes) break;
      if (oldest === address || this.isWished(oldest)) continue;
      this.pictures.delete(oldest);
      this.bytes -= bytesOf(old);
      old.close();
    }
  }

  // For as long as it is wished for, with growing pauses.
  private retry(address: string, signal: AbortSignal): void {
    if (signal.aborted) return;
    const count = this.attempt?.address === address ? this.attempt.count + 1 : 1;
    this.attempt = { address, count };
    if (count === kToldAttempts) this.onProblem({ title: "A slice does not come", detail: "the server is away or busy; it is asked again", field: null });
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      if (signal.aborted) return;
      this.underway = null;
      this.next();
    }, Math.min(kLongestPauseMs, kBusyMs * 2 ** (count - 1)));
  }

  private refuse(address: string, signal: AbortSignal, problem: Problem): void {
    if (signal.aborted) return;
    this.attempt = null;
    if (this.refused.size >= kMostRefusals) this.refused.clear();
    this.refused.add(address);
    this.underway = null;
    this.onProblem(problem);
    this.onPicture();
    this.next();
  }
}

const bytesOf = ({ width, height }: ImageBitmap): number => 4 * width * height;

function problemOf(status: number, text: string): Problem {
  const title = "A slice is refused";
  if (status === 414 || status === 431) return { title, detail: "this view is too long to be sent: its transfer functions have too many points for the server", field: "tf" };
  try {
    const fields = new Fields(parseJson(text, "problem"), "problem");
    return { title, detail: fields.string("detail"), field: fields.has("field") ? fields.string("field") : null };
  } catch (error) {
    if (!(error instanceof FormatError)) throw error;
    return { title, detail: `status ${status}`, field: null };
  }
}
