// SPDX-License-Identifier: Apache-2.0
// The two programs, for tests against the real daemon. BLOCKWALK_BIN is their folder.

import { execFileSync, spawn, type ChildProcess } from "node:child_process";
import { createServer } from "node:net";
import { join } from "node:path";

declare const PAGE_FOLDER: string; // where the build put the page
const kReadyWithinMs = 60000;

const programs = process.env["BLOCKWALK_BIN"] ?? "";
if (programs === "") throw new Error("BLOCKWALK_BIN must name the folder that holds blockwalk and blockwalkd");

export function blockwalk(...words: readonly string[]): void {
  execFileSync(join(programs, "blockwalk"), words, { stdio: ["ignore", "ignore", "inherit"] });
}

export class Daemon {
  private constructor(private readonly process: ChildProcess, readonly port: number) {}

  static async start(port: number, words: readonly string[]): Promise<Daemon> {
    const child = spawn(join(programs, "blockwalkd"), ["--listen", `127.0.0.1:${port}`, "--web-root", PAGE_FOLDER, ...words], { stdio: ["ignore", "inherit", "inherit"] });
    const daemon = new Daemon(child, port);
    const deadline = Date.now() + kReadyWithinMs;
    while (!(await daemon.isReady())) {
      if (child.exitCode !== null) throw new Error(`blockwalkd ended with ${child.exitCode}`);
      if (Date.now() > deadline) throw new Error(`blockwalkd is not ready after ${kReadyWithinMs} ms`);
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    return daemon;
  }

  get address(): string {
    return `http://127.0.0.1:${this.port}/`;
  }

  async stop(signal: NodeJS.Signals): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill(signal);
    await ended;
  }

  private async isReady(): Promise<boolean> {
    try {
      return (await fetch(`${this.address}readyz`)).ok;
    } catch {
      return false; // not listening yet
    }
  }
}

export async function freePort(): Promise<number> {
  const probe = createServer();
  await new Promise<void>((resolve) => probe.listen(0, "127.0.0.1", resolve));
  const address = probe.address();
  await new Promise((resolve) => probe.close(resolve));
  if (address === null || typeof address === "string") throw new Error("no free port");
  return address.port;
}
