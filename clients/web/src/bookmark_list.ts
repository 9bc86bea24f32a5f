// SPDX-License-Identifier: Apache-2.0
// The bookmarks of the volume that is open: kept with what the canvas shows, gone to, renamed, deleted, saved and loaded.

import { Bookmarks, kMostBookmarkBytes, parseBookmarks, volumeOf, writeBookmarks, type Bookmark } from "./bookmarks";
import { byId, element, icon } from "./dom";
import { bindFileButton, saveText } from "./local_files";
import type { Toasts } from "./toasts";
import { formatFragment } from "./url_state";
import type { ViewState } from "./view_state";
import type { VolumeInfo } from "./volume_info";

const kPicture = { width: 128, height: 96 } as const;

export class BookmarkList {
  private readonly list = byId("bookmarks", HTMLElement);
  private readonly note = byId("bookmark-note", HTMLElement);
  private readonly addButton = byId("bookmark-add", HTMLButtonElement);
  private readonly bookmarks = new Bookmarks(storage());
  private volume: VolumeInfo | null = null;
  private view: ViewState | null = null;

  constructor(private readonly toasts: Toasts) {
    this.addButton.addEventListener("click", () => this.keep());
    byId("bookmark-save", HTMLButtonElement).addEventListener("click", () => saveText("blockwalk-bookmarks.json", writeBookmarks(this.bookmarks.all)));
    bindFileButton(byId("bookmark-load", HTMLButtonElement), byId("bookmark-file", HTMLInputElement), kMostBookmarkBytes, (bytes) => {
      const text = new TextDecoder("utf-8", { fatal: true }).decode(bytes);
      this.bookmarks.read();
      this.draw(this.bookmarks.add(parseBookmarks(text)));
    }, (name, detail) => this.toasts.show({ title: `${name} is not read`, detail, field: null }));
    window.addEventListener("storage", () => this.draw(this.bookmarks.read()));
  }

  setVolume(volume: VolumeInfo): void {
    this.volume = volume;
    this.view = null;
    this.draw(this.bookmarks.read());
  }

  get all(): readonly Bookmark[] {
    return this.bookmarks.all;
  }

  show(view: ViewState): void {
    this.view = view;
  }

  private keep(): void {
    const { volume, view } = this;
    if (volume === null || view === null) return;
    this.bookmarks.read();
    const own = this.bookmarks.all.filter((bookmark) => volumeOf(bookmark) === volume.id);
    const names = new Set(own.map(({ name }) => name));
    let number = own.length + 1;
    while (names.has(`View ${number}`)) number++;
    const bookmark = { name: `View ${number}`, view: formatFragment(volume.id, view, volume.type === "rgba8"), picture: pictureOf(byId("canvas", HTMLCanvasElement)) };
    this.draw(this.bookmarks.add([bookmark]));
    const input = this.list.querySelector<HTMLInputElement>("li:last-child input");
    input?.focus();
    input?.select();
  }

  // `fault`: what of a change does not last.
  private draw(fault: string | null): void {
    const { volume } = this;
    const own = this.bookmarks.all.filter((bookmark) => volumeOf(bookmark) === volume?.id);
    this.list.replaceChildren(...own.map((bookmark) => this.item(bookmark)));
    const others = this.bookmarks.all.length - own.length;
    this.note.textContent = fault ?? (others > 0 ? `${others} more of other volumes.` : "");
    this.note.classList.toggle("fault", fault !== null);
    this.note.hidden = this.note.textContent === "";
    byId("bookmark-save", HTMLButtonElement).disabled = this.bookmarks.all.length === 0;
  }

  private item(bookmark: Bookmark): HTMLElement {
    const { name, view, picture } = bookmark;
    const go = element("button", { type: "button", class: "bookmark-go", "aria-label": `Go to ${name}`, title: `Go to ${name}` }, ...(picture === null ? [icon("volume")] : [element("img", { src: picture, alt: "" })]));
    go.addEventListener("click", () => {
      location.hash = view;
    });
    const input = element("input", { type: "text", value: name, maxlength: "120", autocomplete: "off", spellcheck: "false", "aria-label": `Name of ${name}` });
    input.addEventListener("change", () => this.draw(this.bookmarks.rename(bookmark, input.value || name)));
    const remove = element("button", { type: "button", class: "icon-button", "aria-label": `Delete ${name}`, title: "Delete" }, icon("close"));
    remove.addEventListener("click", () => {
      const place = [...this.list.children].findIndex((item) => item.contains(remove));
      this.draw(this.bookmarks.remove(bookmark));
      (this.list.children[Math.min(place, this.list.childElementCount - 1)]?.querySelector<HTMLElement>(".icon-button") ?? this.addButton).focus();
    });
    return element("li", { class: "bookmark" }, go, input, remove);
  }
}

// Even to ask for it may be forbidden.
function storage(): Storage | null {
  try {
    return window.localStorage;
  } catch {
    return null;
  }
}

// The middle of what the canvas shows, small.
function pictureOf(canvas: HTMLCanvasElement): string | null {
  const small = document.createElement("canvas");
  [small.width, small.height] = [kPicture.width, kPicture.height];
  const context = small.getContext("2d");
  if (context === null || canvas.width === 0 || canvas.height === 0) return null;
  const scale = Math.max(kPicture.width / canvas.width, kPicture.height / canvas.height);
  const [width, height] = [canvas.width * scale, canvas.height * scale];
  context.drawImage(canvas, (kPicture.width - width) / 2, (kPicture.height - height) / 2, width, height);
  return small.toDataURL("image/jpeg", 0.75);
}
