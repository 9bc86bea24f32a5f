// SPDX-License-Identifier: Apache-2.0
// Steps in time: which one is shown, and playing them. A step that is played waits until the one before was shown, so
// that none is left out where steps take longer than a beat.

import { byId } from "./dom";
import { withMember } from "./members";
import { formatValue } from "./units";
import type { ViewChange, ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kRates = [1, 2, 5, 10, 15, 24, 30] as const; // steps a second

export class TimeBar {
  private readonly bar = byId("time-bar", HTMLElement);
  private readonly playButton = byId("time-play", HTMLButtonElement);
  private readonly slider = byId("time-step", HTMLInputElement);
  private readonly label = byId("time-label", HTMLOutputElement);
  private readonly rate = byId("time-rate", HTMLSelectElement);
  private steps = 1;
  private stepText: { readonly length: number; readonly unit: string } | null = null;
  private view: ViewState | null = null;
  private step = 0;
  private isPlaying = false;
  private isDue = false; // a beat has passed
  private isShown = true; // a frame shows the step
  private beat: number | undefined;

  constructor(private readonly onChange: (change: ViewChange) => void) {
    for (const rate of kRates) this.rate.add(new Option(`${rate}/s`, String(rate), false, rate === 10));
    this.slider.addEventListener("input", () => {
      this.stop();
      this.go(Number(this.slider.value));
    });
    this.playButton.addEventListener("click", () => this.toggle());
    this.rate.addEventListener("change", () => {
      if (this.isPlaying) this.play();
    });
  }

  setVolume(volume: VolumeInfo): void {
    this.stop();
    this.steps = volume.steps;
    this.stepText = volume.timeStep === null ? null : parseTimeStep(volume.timeStep);
    this.slider.max = String(volume.steps - 1);
    this.view = null;
    this.bar.hidden = this.steps < 2;
  }

  close(): void {
    this.stop();
    this.bar.hidden = true;
  }

  show(view: ViewState): void {
    const step = stepOf(view);
    if (step !== this.step) this.isShown = false;
    this.view = view;
    this.step = step;
    this.slider.value = String(step);
    const at = this.stepText === null ? "" : ` · ${formatValue(this.step * this.stepText.length)} ${this.stepText.unit}`.trimEnd();
    const text = `${this.step + 1} of ${this.steps}${at}`;
    this.label.textContent = text;
    this.slider.setAttribute("aria-valuetext", `Step ${text}`);
  }

  // The newest view of which a frame is on the screen.
  frameShown(view: ViewState): void {
    this.isShown ||= stepOf(view) === this.step;
    this.advance();
  }

  toggle(): void {
    if (this.isPlaying) this.stop();
    else this.play();
  }

  move(by: number): void {
    this.stop();
    this.go(Math.min(this.steps - 1, Math.max(0, this.step + by)));
  }

  private go(step: number): void {
    if (step === this.step || this.view === null) return;
    this.onChange({ others: withMember(this.view.others, "time", String(step)) });
  }

  private play(): void {
    if (this.steps < 2) return;
    this.isPlaying = true;
    this.isDue = true;
    window.clearInterval(this.beat);
    this.beat = window.setInterval(() => {
      this.isDue = true;
      this.advance();
    }, 1000 / Number(this.rate.value));
    this.showPlaying();
    this.advance();
  }

  private stop(): void {
    if (!this.isPlaying) return;
    this.isPlaying = false;
    window.clearInterval(this.beat);
    this.showPlaying();
  }

  private advance(): void {
    if (!this.isPlaying || !this.isDue || !this.isShown) return;
    this.isDue = false;
    this.go((this.step + 1) % this.steps);
  }

  private showPlaying(): void {
    this.playButton.setAttribute("aria-pressed", String(this.isPlaying));
    this.playButton.title = this.isPlaying ? "Stop (space)" : "Play (space)";
    this.bar.classList.toggle("playing", this.isPlaying);
  }
}

function stepOf(view: ViewState): number {
  return Number(view.others.time ?? 0);
}

// "0.5 s"
function parseTimeStep(text: string): { readonly length: number; readonly unit: string } | null {
  const [number = "", unit = ""] = text.split(" ", 2);
  const length = Number(number);
  return Number.isFinite(length) && length > 0 ? { length, unit } : null;
}
