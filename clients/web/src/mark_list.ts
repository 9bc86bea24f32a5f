// SPDX-License-Identifier: Apache-2.0
// The list of marks: their values, texts and colours, and the ways in and out of the page.

import { byId, element, icon } from "./dom";
import { FormatError } from "./json_fields";
import { csvOf, kMarkNames, kMostMarks, kMostText, marksFile, parseMarksFile, valueOf, type Mark } from "./marks";
import { formatMeasure, type Ruler } from "./measure";
import type { Toasts } from "./toasts";

const kMostFileBytes = 1024 * 1024;

export class MarkList {
  private readonly list = byId("mark-list", HTMLOListElement);
  private readonly none = byId("mark-none", HTMLElement);
  private readonly tooLong = byId("marks-too-long", HTMLElement);
  private readonly out = byId("mark-out", HTMLElement);
  private readonly file = byId("marks-file", HTMLInputElement);
  private marks: readonly Mark[] = [];
  private ruler: Ruler = { unit: "", measured: (point) => point };
  private said = "";

  constructor(private readonly onChange: (marks: readonly Mark[]) => void, private readonly volume: () => string, private readonly toasts: Toasts) {
    byId("marks-copy", HTMLButtonElement).addEventListener("click", (event) => void this.copy(event.currentTarget));
    byId("marks-save", HTMLButtonElement).addEventListener("click", () => this.save());
    byId("marks-load", HTMLButtonElement).addEventListener("click", () => this.file.click());
    byId("marks-clear", HTMLButtonElement).addEventListener("click", () => this.onChange([]));
    this.file.addEventListener("change", () => void this.load());
  }

  // `fits`: whether the address has them.
  show(marks: readonly Mark[], ruler: Ruler, fits: boolean): void {
    this.tooLong.hidden = fits;
    this.none.hidden = marks.length > 0;
    this.out.hidden = marks.length === 0;
    const text = JSON.stringify(marks) + ruler.unit;
    if (text === this.said) return;
    this.said = text;
    [this.marks, this.ruler] = [marks, ruler];
    // A text that is being typed stays under the fingers.
    const typed = document.activeElement instanceof HTMLInputElement && this.list.contains(document.activeElement) && document.activeElement.type === "text";
    if (typed && this.list.children.length === marks.length) return;
    this.list.replaceChildren(...marks.map((mark, number) => this.row(mark, number)));
  }

  // A mark was made whose text is still to be typed.
  typeText(number: number): void {
    const input = this.list.children[number]?.querySelector("input[type=text]");
    if (input instanceof HTMLInputElement) input.focus();
  }

  private row(mark: Mark, number: number): HTMLElement {
    const value = valueOf(mark, this.ruler);
    const name = kMarkNames[mark.kind];
    const colour = element("input", { type: "color", class: "well", value: `#${mark.colour}`, "aria-label": `Colour of ${name} ${number + 1}` });
    colour.addEventListener("change", () => this.put(number, { colour: colour.value.slice(1) }));
    const text = element("input", { type: "text", class: "mark-text", value: mark.text, maxlength: String(kMostText), placeholder: name, autocomplete: "off", "aria-label": `Text of ${name} ${number + 1}` });
    text.addEventListener("input", () => this.put(number, { text: text.value }));
    const remove = element("button", { type: "button", class: "icon-button", title: "Delete", "aria-label": `Delete ${name} ${number + 1}` }, icon("close"));
    remove.addEventListener("click", () => this.onChange(this.marks.filter((_, other) => other !== number)));
    return element("li", {}, colour, text, element("span", { class: "mark-value" }, value === null ? "" : formatMeasure(value.value, value.unit)), remove);
  }

  private put(number: number, change: Partial<Mark>): void {
    this.onChange(this.marks.map((mark, other) => (other === number ? { ...mark, ...change } : mark)));
  }

  private async copy(button: EventTarget | null): Promise<void> {
    try {
      await navigator.clipboard.writeText(csvOf(this.marks, this.ruler));
      if (!(button instanceof HTMLElement)) return;
      button.classList.add("done");
      window.setTimeout(() => button.classList.remove("done"), 1500);
    } catch (error) {
      this.report("The marks could not be copied", error);
    }
  }

  private save(): void {
    const volume = this.volume();
    const address = URL.createObjectURL(new Blob([marksFile(volume, this.marks)], { type: "application/json" }));
    const link = element("a", { href: address, download: `${volume.replace(/[^\w.-]/g, "_")}-marks.json` });
    link.click();
    window.setTimeout(() => URL.revokeObjectURL(address), 1000);
  }

  // On top of those that are there.
  private async load(): Promise<void> {
    const chosen = this.file.files?.[0];
    this.file.value = "";
    if (chosen === undefined) return;
    try {
      if (chosen.size > kMostFileBytes) throw new FormatError("file", `at most ${kMostFileBytes} bytes`);
      const marks = [...this.marks, ...parseMarksFile(await chosen.text())];
      if (marks.length > kMostMarks) throw new FormatError("file.marks", `at most ${kMostMarks} marks with those that are there`);
      this.onChange(marks);
    } catch (error) {
      this.report(`${chosen.name} could not be read`, error);
    }
  }

  private report(title: string, error: unknown): void {
    this.toasts.show({ title, detail: error instanceof Error ? error.message : String(error), field: null });
  }
}
