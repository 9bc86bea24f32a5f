// SPDX-License-Identifier: Apache-2.0
// The labels of a channel as a list to search, and to show and hide by. Only rows in sight are elements: there may be
// tens of thousands. One row is in the order of the tab key, arrows go from one to the next.

import { element, part } from "./dom";
import { labelsOf, sampleAlong, shownIn, withShown, type Label, type LabelList } from "./label_list";
import { formatCount } from "./units";
import type { ChannelInfo } from "./volume_info";

const kRowPixels = 32;
const kRowPixelsByFinger = 44;
const kMargin = 4; // rows beyond those in sight, either way

export class LabelTable {
  readonly element: HTMLElement;
  private readonly search: HTMLInputElement;
  private readonly scroller: HTMLElement;
  private readonly rows: HTMLElement;
  private readonly status: HTMLElement;
  private readonly list: LabelList;
  private readonly rowPixels = window.matchMedia("(max-width: 720px)").matches ? kRowPixelsByFinger : kRowPixels;
  private readonly drawn = new Map<number, HTMLElement>(); // by place among those found
  private found: readonly number[] = []; // places in the list
  private shown: readonly boolean[] = [];
  private transfer: string | null = null; // that `shown` is of
  private current = 0; // the row that Tab comes to, among those found

  // `fail`: why labels cannot be hidden.
  constructor(template: HTMLTemplateElement, channel: ChannelInfo, isAlone: boolean, private readonly onChange: (transfer: string) => void, private readonly fail: (reason: string) => void) {
    const copy = template.content.cloneNode(true);
    if (!(copy instanceof DocumentFragment)) throw new Error("a template's copy is a fragment");
    this.list = labelsOf(channel);
    this.element = part(copy, ".labels", HTMLElement);
    this.search = part(copy, ".label-search", HTMLInputElement);
    this.scroller = part(copy, ".label-scroller", HTMLElement);
    this.rows = part(copy, ".label-rows", HTMLElement);
    this.status = part(copy, ".label-status", HTMLElement);
    if (!isAlone) part(copy, "h2 span", HTMLElement).textContent = `Labels of ${channel.name}`;
    this.rows.setAttribute("aria-label", isAlone ? "Labels" : `Labels of ${channel.name}`);
    this.rows.style.setProperty("--row", `${this.rowPixels}px`);
    this.search.addEventListener("input", () => this.filter());
    this.scroller.addEventListener("scroll", () => this.draw());
    this.rows.addEventListener("keydown", (event) => this.pressed(event));
    part(copy, ".label-all", HTMLButtonElement).addEventListener("click", () => this.setFound(true));
    part(copy, ".label-none", HTMLButtonElement).addEventListener("click", () => this.setFound(false));
    this.filter();
    // Before it is on the page it has no height.
    new ResizeObserver(() => this.draw()).observe(this.scroller);
  }

  show(transfer: string): void {
    if (transfer === this.transfer) return;
    this.transfer = transfer;
    this.shown = shownIn(this.list, transfer);
    this.say();
    this.draw();
  }

  // Every word in the name, or the number begins with it.
  private filter(): void {
    const words = this.search.value.toLowerCase().split(/\s+/).filter((word) => word !== "");
    const isFound = ({ value, name }: Label): boolean => words.every((word) => String(value).startsWith(word) || (name ?? "").toLowerCase().includes(word));
    this.found = this.list.labels.flatMap((label, place) => (isFound(label) ? [place] : []));
    this.current = 0;
    this.scroller.scrollTop = 0;
    this.rows.style.height = `${this.found.length * this.rowPixels}px`;
    for (const row of this.drawn.values()) row.remove();
    this.drawn.clear();
    this.say();
    this.draw();
  }

  private say(): void {
    const { labels, isWhole } = this.list;
    const hidden = this.shown.filter((isShown) => !isShown).length;
    const what = this.found.length < labels.length ? `${formatCount(this.found.length)} of ${formatCount(labels.length)} found` : `${formatCount(labels.length)} labels`;
    this.status.textContent = `${what}${hidden > 0 ? `, ${formatCount(hidden)} hidden` : ""}${isWhole ? "" : "; those that have a name or a colour"}`;
  }

  // The rows in sight, and the one that has the focus.
  private draw(): void {
    const { scrollTop, clientHeight } = this.scroller;
    const [from, to] = [Math.floor(scrollTop / this.rowPixels) - kMargin, Math.ceil((scrollTop + clientHeight) / this.rowPixels) + kMargin];
    const isWanted = (row: number): boolean => (row >= from && row < to) || row === this.current;
    for (const [row, made] of this.drawn) {
      if (isWanted(row) || made.contains(document.activeElement)) continue;
      made.remove();
      this.drawn.delete(row);
    }
    for (let row = Math.max(0, from); row < Math.min(this.found.length, to); row++) this.drawRow(row);
    if (this.found.length > 0) this.drawRow(this.current);
  }

  private drawRow(row: number): void {
    const place = this.found[row] ?? 0;
    const label = this.list.labels[place];
    if (label === undefined) return;
    const made = this.drawn.get(row) ?? this.makeRow(row, place, label);
    const check = part(made, "input", HTMLInputElement);
    check.checked = this.shown[place] ?? true;
    for (const control of made.querySelectorAll<HTMLElement>("input, button")) control.tabIndex = row === this.current ? 0 : -1;
  }

  private makeRow(row: number, place: number, label: Label): HTMLElement {
    const text = label.name ?? `Label ${label.value}`;
    const swatch = element("span", { class: "label-colour", "aria-hidden": "true" });
    swatch.style.background = `#${sampleAlong(this.list.own, label.value).colour}`;
    const check = element("input", { type: "checkbox" });
    const name = element("label", { title: text }, check, swatch, element("span", { class: "label-name" }, text));
    const only = element("button", { type: "button", class: "link-button", "aria-label": `Only ${text}` }, "only");
    const facts = [...(label.name === null ? [] : [String(label.value)]), ...(label.count === null ? [] : [formatCount(label.count)])];
    const fact = element("span", { class: "label-fact", title: label.count === null ? `Label ${label.value}` : `Label ${label.value}, ${formatCount(label.count)} voxels` }, facts.join(" · "));
    const made = element("div", { class: "label-row", role: "listitem", "aria-setsize": String(this.found.length), "aria-posinset": String(row + 1) }, name, fact, only);
    made.style.top = `${row * this.rowPixels}px`;
    check.addEventListener("change", () => this.set((at) => (at === place ? check.checked : (this.shown[at] ?? true))));
    only.addEventListener("click", () => this.set((at) => at === place));
    made.addEventListener("focusin", () => {
      if (this.current === row) return;
      this.current = row;
      this.draw();
    });
    this.drawn.set(row, made);
    // In the order they are read.
    const after = [...this.rows.children].find((other) => other instanceof HTMLElement && parseInt(other.style.top, 10) > row * this.rowPixels);
    this.rows.insertBefore(made, after ?? null);
    return made;
  }

  private setFound(isShown: boolean): void {
    const found = new Set(this.found);
    this.set((place) => (found.has(place) ? isShown : (this.shown[place] ?? true)));
  }

  private set(isShown: (place: number) => boolean): void {
    const transfer = withShown(this.list, this.transfer ?? "auto", this.list.labels.map((_, place) => isShown(place)));
    if (transfer !== null) return this.onChange(transfer);
    this.fail("Labels that are shown and hidden in turns need a point each, and a transfer function has at most 1024.");
    this.draw();
  }

  private pressed(event: KeyboardEvent): void {
    const page = Math.max(1, Math.floor(this.scroller.clientHeight / this.rowPixels) - 1);
    const steps: Readonly<Record<string, number>> = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    const step = steps[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const row = Math.max(0, Math.min(this.found.length - 1, this.current + step));
    const isButton = document.activeElement instanceof HTMLButtonElement;
    const [top, bottom] = [row * this.rowPixels, (row + 1) * this.rowPixels];
    if (top < this.scroller.scrollTop) this.scroller.scrollTop = top;
    if (bottom > this.scroller.scrollTop + this.scroller.clientHeight) this.scroller.scrollTop = bottom - this.scroller.clientHeight;
    this.draw();
    this.drawRow(row);
    this.drawn.get(row)?.querySelector<HTMLElement>(isButton ? "button" : "input")?.focus({ preventScroll: true });
  }
}
