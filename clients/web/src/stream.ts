// SPDX-License-Identifier: Apache-2.0
// One volume's WebSocket: connects, reconnects with growing pauses, turns messages into typed events.
// It keeps no view: after each hello its owner sends the whole one again.

import { Fields, FormatError, parseJson } from "./json_fields";
import { ackMessage, kSubprotocol, parseFrame, parseMessage, parseProblem, viewMessage } from "./protocol";
import type { Frame, Problem, ViewMembers } from "./protocol";
import type { VolumeInfo } from "./volume_info";

export interface StreamEvents {
  hello(volume: VolumeInfo): void;
  frame(frame: Frame): void;
  problem(problem: Problem, id: number | null): void; // `id`: of the view message that is refused
  down(): void; // at each connection that ended or was refused; another attempt follows by itself
  refused(problem: Problem | null): void; // after that: why the server opens no stream; null when nobody knows
}

const kFirstPauseMs = 250;
const kLongestPauseMs = 4000;
const kAnswerTimeoutMs = 10000;
const kMostMessageBytes = 65536;
const kTooBig = 1009; // of RFC 6455: a message was
const kRefusals: readonly number[] = [401, 403, 404, 429, 503];

export class Stream {
  private socket: WebSocket | null = null;
  private greeted = false;
  private closed = false;
  private attempts = 0;
  private retry: number | undefined;
  private nextId = 1; // never starts again: ids only grow

  constructor(
    private readonly address: string,
    private readonly events: StreamEvents,
  ) {
    this.connect();
  }

  // True from the hello until the connection ends.
  get isOpen(): boolean {
    return this.greeted;
  }

  // Sends a change of view and returns its id. Precondition: isOpen.
  sendView(members: ViewMembers): number {
    const id = this.nextId++;
    const text = viewMessage(id, members);
    const bytes = new TextEncoder().encode(text).length;
    // The server would end the connection, which would then be told the same again, without end.
    if (bytes > kMostMessageBytes) window.queueMicrotask(() => this.events.problem(tooLong(`it takes ${bytes} bytes, and the server reads ${kMostMessageBytes}`, longestOf(members)), id));
    else this.socket?.send(text);
    return id;
  }

  // Says that a frame was shown or superseded: the server may send another.
  acknowledge(id: number): void {
    if (this.greeted) this.socket?.send(ackMessage(id));
  }

  close(): void {
    this.closed = true;
    window.clearTimeout(this.retry);
    this.greeted = false;
    this.socket?.close(1000);
  }

  private connect(): void {
    const socket = new WebSocket(this.address, kSubprotocol);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onmessage = (event: MessageEvent<unknown>) => {
      if (!this.closed) this.receive(event.data);
    };
    socket.onclose = ({ code }) => {
      if (this.closed) return;
      if (code === kTooBig) this.events.problem(tooLong("the server reads no message of this size", null), this.nextId - 1);
      this.reconnect();
    };
  }

  private reconnect(): void {
    const wasRefused = !this.greeted;
    this.greeted = false;
    const pause = Math.min(kLongestPauseMs, kFirstPauseMs * 2 ** this.attempts++);
    // Spread, so that many pages do not knock on a restarted server at the same moment.
    this.retry = window.setTimeout(() => this.connect(), pause * (0.75 + 0.5 * Math.random()));
    this.events.down();
    if (wasRefused) void this.askWhy(this.attempts);
  }

  // A browser hides how the server answered an upgrade, but the same address says it to a plain GET.
  private async askWhy(attempt: number): Promise<void> {
    const problem = await fetchRefusal(this.address.replace(/^ws/, "http"));
    if (!this.closed && !this.greeted && attempt === this.attempts) this.events.refused(problem);
  }

  private receive(data: unknown): void {
    try {
      if (data instanceof ArrayBuffer) this.events.frame(parseFrame(data));
      else if (typeof data === "string") this.receiveText(data);
    } catch (error) {
      if (!(error instanceof FormatError)) throw error;
      this.events.problem({ title: "The server sent what this page cannot read", detail: error.message, field: null }, null);
    }
  }

  private receiveText(text: string): void {
    const message = parseMessage(text);
    if (message.kind === "hello") {
      this.greeted = true;
      this.attempts = 0;
      this.events.hello(message.volume);
    } else if (message.kind === "error") {
      this.events.problem(message.problem, message.id);
    }
  }
}

const tooLong = (detail: string, field: string | null): Problem => ({ title: "This view is too long to be sent", detail: `${detail}; it stays as it was`, field });

function longestOf(members: ViewMembers): string | null {
  const sizes = Object.entries(members).map(([name, value]) => [name, JSON.stringify(value).length] as const);
  return sizes.reduce<readonly [string | null, number]>((most, one) => (one[1] > most[1] ? one : most), [null, 0])[0];
}

// Null when the server is away, or would open a stream now: the next attempt shows it.
async function fetchRefusal(address: string): Promise<Problem | null> {
  try {
    const response = await fetch(address, { cache: "no-store", signal: AbortSignal.timeout(kAnswerTimeoutMs) });
    if (!kRefusals.includes(response.status)) return null;
    return parseProblem(new Fields(parseJson(await response.text(), "problem"), "problem"));
  } catch (error) {
    if (error instanceof FormatError || error instanceof DOMException || error instanceof TypeError) return null; // no answer, or none of this server's
    throw error;
  }
}
