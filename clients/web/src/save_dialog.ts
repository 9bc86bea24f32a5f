// SPDX-License-Identifier: Apache-2.0
// Saves the picture in the size and quality that are asked for, and says how a program gets the same one.

import { byId } from "./dom";
import { safeName, saveBlob } from "./local_files";
import { withMember } from "./members";
import { problemIn } from "./protocol";
import { withScaleBar } from "./scale_bar";
import type { Toasts } from "./toasts";
import { formatFragment, imageQuery } from "./url_state";
import { kNoPagePart, type Size, type ViewState } from "./view_state";

const kMostSide = 8192;
const kLongSideOf4K = 3840;

export interface Shown {
  readonly volume: string; // id
  readonly view: ViewState;
  readonly isColoured: boolean;
  readonly lengthUnit: string | null;
}

export class SaveDialog {
  private readonly dialog = byId("save", HTMLDialogElement);
  private readonly form = byId("save-form", HTMLFormElement);
  private readonly samples = byId("save-samples", HTMLSelectElement);
  private readonly transparent = byId("save-transparent", HTMLInputElement);
  private readonly bar = byId("save-bar", HTMLInputElement);
  private readonly link = byId("save-link", HTMLAnchorElement);
  private readonly sizeText = byId("save-size", HTMLOutputElement);
  private shown: Shown | null = null;

  constructor(private readonly imageAddress: (id: string) => string, private readonly toasts: Toasts) {
    byId("save-button", HTMLButtonElement).addEventListener("click", () => this.dialog.showModal());
    byId("save-close", HTMLButtonElement).addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog) this.dialog.close(); // the backdrop
    });
    this.form.addEventListener("change", () => this.update());
    this.link.addEventListener("click", (event) => {
      if (!this.bar.checked || this.shown === null) return this.dialog.close();
      event.preventDefault(); // the server's picture has none
      if (this.link.ariaDisabled !== "true") void this.saveWithBar(this.shown);
    });
    for (const button of this.dialog.querySelectorAll<HTMLButtonElement>("button[data-copy]")) {
      button.addEventListener("click", () => void this.copy(button, button.dataset["copy"] ?? ""));
    }
  }

  // Nothing to save until a volume is open again.
  clear(): void {
    this.shown = null;
  }

  show(shown: Shown): void {
    this.shown = shown;
    this.update();
  }

  // In the size and quality that are chosen here.
  get chosen(): Shown | null {
    return this.shown && { ...this.shown, view: this.wanted(this.shown.view) };
  }

  private update(): void {
    if (this.shown === null) return;
    const { volume } = this.shown;
    const view = this.wanted(this.shown.view);
    this.sizeText.textContent = `${view.size[0]} × ${view.size[1]} pixels`;
    this.link.href = this.address(this.shown, view);
    this.link.download = `${volume}.png`;
  }

  private async saveWithBar(shown: Shown): Promise<void> {
    const view = this.wanted(shown.view);
    this.link.setAttribute("aria-disabled", "true");
    try {
      const response = await fetch(this.address(shown, view));
      if (!response.ok) return this.toasts.show(problemIn(await response.text(), "The picture is refused"));
      saveBlob(`${safeName(shown.volume)}.png`, await withScaleBar(await response.blob(), view, shown.lengthUnit));
      this.dialog.close();
    } catch (error) {
      this.toasts.show({ title: "The picture could not be saved", detail: error instanceof Error ? error.message : String(error), field: null });
    } finally {
      this.link.removeAttribute("aria-disabled");
    }
  }

  private wanted(view: ViewState): ViewState {
    const [width, height] = view.size;
    const chosen = new FormData(this.form).get("size");
    const factor = chosen === "double" ? 2 : chosen === "4k" ? kLongSideOf4K / Math.max(width, height) : 1;
    const limit = Math.min(factor, kMostSide / Math.max(width, height));
    const side = (length: number): number => Math.max(1, Math.round(length * limit));
    const size: Size = [side(width), side(height)];
    const background = this.transparent.checked ? `${view.background.slice(0, 6)}00` : view.background;
    return { ...view, size, background, others: this.samples.value === "" ? view.others : withMember(view.others, "samples", this.samples.value) };
  }

  private address({ volume, isColoured }: Shown, view: ViewState): string {
    return new URL(`${this.imageAddress(volume)}?${imageQuery(view, isColoured)}`, document.baseURI).href;
  }

  private text(kind: string, shown: Shown): string {
    const view = this.wanted(shown.view);
    const address = this.address(shown, view).replaceAll("'", "%27");
    const file = `${shown.volume.replace(/[^\w.-]/g, "_")}.png`;
    if (kind === "curl") return `curl '${address}' -o ${file}`;
    if (kind === "python") return `import urllib.request\n\nurl = "${address}"\nwith urllib.request.urlopen(url) as answer, open("${file}", "wb") as file:\n    file.write(answer.read())\n`;
    const page = new URL(formatFragment(shown.volume, { ...view, ...kNoPagePart }, shown.isColoured), document.baseURI).href.replaceAll("'", "%27");
    return kind === "cli" ? `blockwalk render '${page}' -o ${file} --size ${view.size.join("x")}` : location.href;
  }

  private async copy(button: HTMLButtonElement, kind: string): Promise<void> {
    if (this.shown === null) return;
    try {
      await navigator.clipboard.writeText(this.text(kind, this.shown));
      button.classList.add("done");
      window.setTimeout(() => button.classList.remove("done"), 1500);
    } catch (error) {
      this.toasts.show({ title: "It could not be copied", detail: error instanceof Error ? error.message : String(error), field: null });
    }
  }
}
