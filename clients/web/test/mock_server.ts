// SPDX-License-Identifier: Apache-2.0
// A server that speaks the protocol and draws a shaded ball instead of a volume: it turns with the eye, and shrinks
// with the lower bound of the first range; its colour is that of the first channel drawn. It sends a coarse frame at once and the final one a little later.

import { readFile } from "node:fs/promises";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { extname, join } from "node:path";
import { WebSocketServer, type WebSocket } from "ws";
import { encodePng } from "./png";
import { MockAnimations } from "./mock_animation";
import { answerRegion, answerSlice } from "./mock_slices";
import { sampleLabels, sampleVolume } from "./sample_volume";

type View = Record<string, unknown>;

const kHeaderBytes = 32 * 1024; // as the server has it
const kTypes: Readonly<Record<string, string>> = {
  ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
};

export interface ListedVolume {
  readonly id: string;
  readonly state: "ready" | "loading" | "failed";
  readonly type: string;
  readonly channelNames?: readonly string[];
  readonly labels?: number; // it is of so many
  readonly steps?: number; // in time, half a second apart
  readonly error?: string;
  readonly fields?: object; // of its description, in place of the sample's
}

export class MockServer {
  volumes: readonly ListedVolume[];
  readonly views: View[] = []; // every view message, as it came
  readonly acks: number[] = [];
  refusal: { readonly status: number; readonly title: string; readonly detail: string } | null = null; // of every stream
  attempts = 0; // at a stream
  refused: { readonly member: string; readonly value: unknown } | null = null; // views that say it are refused for it
  refusalAfterMs = 0;
  ended: { readonly member: string; readonly value: unknown } | null = null; // views that say it are too large: the stream ends
  readonly images: string[] = []; // the queries of pictures that were asked for
  hit: readonly number[] | null = null; // the place that every pixel shows
  readonly picks: string[] = []; // the queries of pixels that were asked for
  pickDelayMs = 0;
  finalAfterMs = 120; // of a still view
  newest: { readonly view: View; readonly seq: number; readonly final: boolean } | null = null; // the frame that was sent last, and the view it shows
  readonly slices: string[] = []; // the queries of slices that were asked for
  readonly regions: string[] = [];
  sliceDelayMs = 0;
  sliceRefusal: { readonly status: number; readonly detail: string } | null = null;
  readonly animations = new MockAnimations();
  abandoned = 0; // requests of slices that nobody waited for
  mostSlices = 0; // open at the same time
  private openSlices = 0;
  reasons: readonly object[] = []; // why pictures are empty: in every frame's header
  private readonly http: Server;
  private readonly sockets = new WebSocketServer({ noServer: true, handleProtocols: () => "blockwalk.v1" });

  constructor(private readonly pageFolder: string, volumes: readonly ListedVolume[]) {
    this.volumes = volumes;
    this.http = createServer({ maxHeaderSize: kHeaderBytes }, (request, response) => void this.answer(request, response));
    this.http.on("upgrade", (request, socket, head) => {
      ++this.attempts;
      if (this.refusal !== null) return void socket.end(`HTTP/1.1 ${this.refusal.status} Refused\r\nContent-Length: 0\r\n\r\n`);
      const id = /^\/api\/v1\/volumes\/([^/]+)\/stream$/.exec(request.url ?? "")?.[1];
      const volume = this.volumes.find((listed) => listed.id === decodeURIComponent(id ?? ""));
      if (volume?.state !== "ready") return void socket.end("HTTP/1.1 503 Service Unavailable\r\n\r\n");
      this.sockets.handleUpgrade(request, socket, head, (webSocket) => this.serve(webSocket, volume));
    });
  }

  // Streams that are open.
  get streams(): number {
    return this.sockets.clients.size;
  }

  // Listens on a port, 0 for a free one, and returns it.
  async start(port = 0): Promise<number> {
    await new Promise<void>((resolve) => this.http.listen(port, "127.0.0.1", resolve));
    const address: AddressInfo | string | null = this.http.address();
    if (address === null || typeof address === "string") throw new Error("the mock has no port");
    return address.port;
  }

  // Ends at once, as a killed process does.
  async stop(): Promise<void> {
    for (const socket of this.sockets.clients) socket.terminate();
    this.http.closeAllConnections();
    await new Promise((resolve) => this.http.close(resolve));
  }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = new URL(request.url ?? "/", "http://mock").pathname;
    if (path === "/api/v1/volumes") {
      const volumes = this.volumes.map((listed) => (listed.state === "ready" ? { ...describe(listed), ...listed, ...listed.fields, labels: undefined } : { name: listed.id, ...listed }));
      return void response.writeHead(200, { "content-type": "application/json" }).end(JSON.stringify({ volumes }));
    }
    if (path.endsWith("/stream") && this.refusal !== null) {
      const problem = { type: "about:blank", ...this.refusal };
      return void response.writeHead(this.refusal.status, { "content-type": "application/problem+json" }).end(JSON.stringify(problem));
    }
    if (path === "/api/v1/device") return void response.writeHead(200, { "content-type": "application/json" }).end(JSON.stringify({ name: "mock", kind: "software" }));
    if (path.endsWith("/animate")) return this.animations.answer(request, response);
    if (path.endsWith("/pick")) return this.answerPick(new URL(request.url ?? "/", "http://mock").searchParams, response);
    if (path.endsWith("/image")) return this.answerImage(new URL(request.url ?? "/", "http://mock").searchParams, response);
    if (path.endsWith("/slice")) return this.slice(new URL(request.url ?? "/", "http://mock").searchParams, response);
    if (path.endsWith("/region")) {
      const { searchParams } = new URL(request.url ?? "/", "http://mock");
      this.regions.push(searchParams.toString());
      return answerRegion(searchParams, response);
    }
    const file = path === "/" ? "/index.html" : path;
    const type = kTypes[extname(file)];
    if (type === undefined || file.includes("..")) return void response.writeHead(404).end();
    const body = await readFile(join(this.pageFolder, file)).catch(() => null);
    if (body === null) return void response.writeHead(404).end();
    response.writeHead(200, { "content-type": type, "content-security-policy": "default-src 'self'; img-src 'self' data:" }).end(body);
  }

  private answerImage(query: URLSearchParams, response: ServerResponse): void {
    this.images.push(query.toString());
    const [width = 1, height = 1] = (query.get("size") ?? "").split("x").map(Number);
    const image = encodePng(Math.min(320, width), Math.min(320, height), (x, y) => [x % 256, y % 256, 128]);
    response.writeHead(200, { "content-type": "image/png" }).end(image);
  }

  private slice(query: URLSearchParams, response: ServerResponse): void {
    this.slices.push(query.toString());
    this.mostSlices = Math.max(this.mostSlices, ++this.openSlices);
    response.on("close", () => {
      --this.openSlices;
      if (!response.writableFinished) ++this.abandoned;
    });
    setTimeout(() => answerSlice(query, this.sliceRefusal, response), this.sliceDelayMs);
  }

  private answerPick(query: URLSearchParams, response: ServerResponse): void {
    this.picks.push(query.toString());
    const pick = this.hit === null ? { hit: false } : { hit: true, world: this.hit, voxel: this.hit.map(Math.floor), t: 1, level: 0, values: [42] };
    setTimeout(() => response.writeHead(200, { "content-type": "application/json" }).end(JSON.stringify(pick)), this.pickDelayMs);
  }

  private serve(socket: WebSocket, listed: ListedVolume): void {
    const hello = { type: "hello", version: "blockwalk.v1", volume: { ...describe(listed), ...stepsOf(listed), ...listed.fields }, limits: {} };
    socket.send(JSON.stringify(hello));
    let view: View = {};
    let seq = 0;
    let final: NodeJS.Timeout | undefined;
    socket.on("message", (data) => {
      const message: View = JSON.parse(String(data)) as View;
      if (message["type"] === "ack") this.acks.push(Number(message["id"]));
      if (message["type"] !== "view") return;
      this.views.push(message);
      if (message["extinction"] !== undefined && listed.type !== "rgba8") {
        const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: "extinction: only rgba8 has one", field: "extinction" };
        return socket.send(JSON.stringify({ type: "error", id: message["id"], problem }));
      }
      const { refused } = this;
      if (refused !== null && message[refused.member] === refused.value) {
        const problem = { type: "about:blank", title: "Bad Request", status: 400, detail: `${refused.member}: not today`, field: refused.member };
        return void setTimeout(() => socket.send(JSON.stringify({ type: "error", id: message["id"], problem })), this.refusalAfterMs);
      }
      const { ended } = this;
      if (ended !== null && message[ended.member] === ended.value) return socket.close(1009);
      view = merged(view, message);
      const draw = (scale: number): void => {
        this.newest = { view, seq: ++seq, final: scale === 1 };
        socket.send(drawFrame(view, seq, scale, this.reasons));
      };
      draw(0.25);
      clearTimeout(final);
      final = setTimeout(() => draw(1), this.finalAfterMs);
    });
    socket.on("close", () => clearTimeout(final));
  }

  // Sends one text message to every page.
  tell(message: object): void {
    for (const socket of this.sockets.clients) socket.send(JSON.stringify(message));
  }

  // Sends an image of one pixel to every page, as the final frame of the newest view.
  tellFrame(format: string, image: Buffer): void {
    const header = {
      id: this.views.at(-1)?.["id"], seq: 1000, width: 1, height: 1, format, level: 0, final: true, scale: 1, gpu_ms: 1, encode_ms: 1, dropped: 0,
    };
    for (const socket of this.sockets.clients) socket.send(frameMessage(header, image));
  }
}

// As the server does: what a message names changes, and the two ways of seeing depth replace each other.
function merged({ fov, ortho, ...view }: View, message: View): View {
  const lens = "fov" in message || "ortho" in message ? {} : { ...(fov !== undefined && { fov }), ...(ortho !== undefined && { ortho }) };
  return { ...view, ...lens, ...message };
}

function numbers(value: unknown): number[] {
  return Array.isArray(value) ? value.map(Number) : [];
}

// The final frame is at most 320 pixels wide too: drawing in JavaScript is slow, and the page scales it.
function drawFrame(view: View, seq: number, scale: number, reasons: readonly object[]): Buffer {
  const [fullWidth = 1, fullHeight = 1] = numbers(view["size"]);
  const shrink = scale * Math.min(1, 320 / fullWidth);
  const width = Math.max(1, Math.round(fullWidth * shrink));
  const height = Math.max(1, Math.round(fullHeight * shrink));
  const [ex = 0, ey = 0, ez = 1] = numbers(view["eye"]).map((e, i) => e - (numbers(view["target"])[i] ?? 0));
  const range: unknown = view["range"];
  const [lo = 0] = numbers(Array.isArray(range) && Array.isArray(range[0]) ? range[0] : range);
  const [first = 0] = numbers(view["channels"]);
  const background = parseInt(String(view["background"]), 16);
  const yaw = Math.atan2(ex, ez);
  const pitch = Math.atan2(ey, Math.hypot(ex, ez));
  const radius = (0.42 - 0.3 * ((lo - 10) / 240)) * (340 / Math.max(1, Math.hypot(ex, ey, ez)));
  const image = encodePng(width, height, (px, py) => {
    const x = (px + 0.5 - width / 2) / height / radius;
    const y = (height / 2 - py - 0.5) / height / radius;
    const d = x * x + y * y;
    if (d >= 1) return [background >> 16, (background >> 8) & 255, background & 255];
    const z = Math.sqrt(1 - d);
    const band = Math.sin(8 * (Math.atan2(x, z) + yaw)) * Math.sin(8 * (Math.asin(y) + pitch)) > 0 ? 1 : 0.6;
    const light = (0.25 + 0.75 * Math.max(0, 0.4 * x + 0.5 * y + 0.75 * z)) * band;
    const tint = ([[255, 190, 120], [120, 190, 255], [190, 255, 120]] as const)[first % 3] ?? [255, 255, 255];
    return [tint[0] * light, tint[1] * light, tint[2] * light];
  });
  const header = {
    id: view["id"], seq, width, height, format: "png", level: scale < 1 ? 1 : 0, final: scale === 1, scale, gpu_ms: 3.2, encode_ms: 1, dropped: 0,
    ...(reasons.length > 0 && { drawn_pixels: 0, reasons }),
  };
  return frameMessage(header, image);
}

function frameMessage(header: object, image: Buffer): Buffer {
  const text = Buffer.from(JSON.stringify(header));
  const length = Buffer.alloc(4);
  length.writeUInt32LE(text.length);
  return Buffer.concat([length, text, image]);
}

const describe = ({ id, type, channelNames, labels }: ListedVolume): object =>
  labels === undefined ? sampleVolume(id, type, channelNames) : sampleLabels(id, labels, { 2: "liver", 3: "left kidney", 4: "right kidney" });

function stepsOf({ steps }: ListedVolume): object {
  return steps === undefined ? {} : { steps, metadata: { length_unit: "mm", time_step: "0.5 s" } };
}
