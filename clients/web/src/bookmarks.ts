// SPDX-License-Identifier: Apache-2.0
// Views that a person keeps: a name, the address' text, a small picture. The browser keeps them as one JSON text, bounded;
// a file of them has the same form.

import { FormatError, Fields, parseJson } from "./json_fields";
import { parseFragment } from "./url_state";

export const kMostBookmarks = 100;
export const kMostBookmarkBytes = 2 << 20; // of a file, and of all that is kept
const kMostNameChars = 120;
const kMostViewChars = 65536;
const kMostPictureChars = 32768;
const kType = "blockwalk bookmarks";
const kStored = "blockwalk.bookmarks";

export interface Bookmark {
  readonly name: string;
  readonly view: string; // #volume=...&eye=...
  readonly picture: string | null; // a data: address
}

export type BookmarkStorage = Pick<Storage, "getItem" | "setItem">;

export function volumeOf(bookmark: Bookmark): string | null {
  return parseFragment(bookmark.view).volume;
}

export function writeBookmarks(bookmarks: readonly Bookmark[]): string {
  return `${JSON.stringify({ type: kType, version: 1, bookmarks: bookmarks.map(({ name, view, picture }) => ({ name, view, ...(picture !== null && { picture }) })) }, null, 1)}\n`;
}

// Text that is broken anywhere is none of them, and a FormatError says where.
export function parseBookmarks(text: string): readonly Bookmark[] {
  return itemsOf(text).map((item, i) => bookmarkOf(item, `bookmarks[${i}]`));
}

function itemsOf(text: string): readonly unknown[] {
  const fields = new Fields(parseJson(text, "file"), "file");
  if (fields.value("type") !== kType) throw new FormatError("type", `"${kType}"`);
  if (fields.number("version") !== 1) throw new FormatError("version", "1");
  const items = fields.array("bookmarks");
  if (items.length > kMostBookmarks) throw new FormatError("bookmarks", `at most ${kMostBookmarks}; there are ${items.length}`);
  return items;
}

function bookmarkOf(item: unknown, path: string): Bookmark {
  const bookmark = new Fields(item, path);
  const [name, view] = [bookmark.string("name").trim(), bookmark.string("view")];
  if (name.length > kMostNameChars) throw new FormatError(`${path}.name`, `at most ${kMostNameChars} characters`);
  if (!view.startsWith("#") || view.length > kMostViewChars) throw new FormatError(`${path}.view`, `an address from # on, of at most ${kMostViewChars} characters`);
  const { volume, faults } = parseFragment(view);
  if (volume === null) throw new FormatError(`${path}.view`, "volume=ID in it");
  if (faults[0] !== undefined) throw new FormatError(`${path}.view`, `a view; ${faults[0].slice(0, 200)}`);
  const picture = bookmark.has("picture") ? bookmark.string("picture") : null;
  if (picture !== null && (picture.length > kMostPictureChars || !/^data:image\/(jpeg|png|webp);base64,[\w+/]+=*$/.test(picture))) {
    throw new FormatError(`${path}.picture`, `a data: address of a JPEG, PNG or WebP of at most ${kMostPictureChars} characters`);
  }
  return { name, view, picture };
}

// Why it could not be read again; null: it can.
function faultOf(bookmark: Bookmark): string | null {
  try {
    bookmarkOf(bookmark, bookmark.name);
    return null;
  } catch (error) {
    if (!(error instanceof FormatError)) throw error;
    return error.message;
  }
}

// All of a person's bookmarks. Each change says, in words, what of it does not last; null: nothing.
export class Bookmarks {
  private own: readonly Bookmark[] = [];
  private isAhead = false; // of what the browser took
  private broken: string | null = null; // what the browser has, where not all of it could be read

  // `storage` is null, or throws, where the browser keeps nothing for this page.
  constructor(private readonly storage: BookmarkStorage | null) {}

  get all(): readonly Bookmark[] {
    return this.own;
  }

  // What the browser has, which another page may have changed. What is broken is left out, and put aside before it would be
  // written over.
  read(): string | null {
    if (this.isAhead) return null;
    try {
      const text = this.storage?.getItem(kStored) ?? null;
      if (text === null) return null;
      const { bookmarks, faults } = readable(text);
      this.own = bookmarks;
      this.broken = faults.length > 0 ? text : null;
      const more = faults.length > 1 ? `, and ${faults.length - 1} more` : "";
      return faults.length === 0 ? null : `Of the bookmarks that this browser kept this cannot be read: ${faults[0]}${more}. It stays in the browser, aside.`;
    } catch {
      return kForbidden;
    }
  }

  add(added: readonly Bookmark[]): string | null {
    const fault = added.map(faultOf).find((text) => text !== null) ?? null;
    if (fault !== null) return `This view cannot be kept as a bookmark (${fault}).`;
    const others = added.filter((bookmark) => !this.own.some((own) => own.name === bookmark.name && own.view === bookmark.view));
    if (this.own.length + others.length > kMostBookmarks) {
      return `There is room for ${kMostBookmarks} bookmarks, and ${this.own.length} are kept: save them as a file, and delete some.`;
    }
    return this.write([...this.own, ...others]);
  }

  rename(bookmark: Bookmark, name: string): string | null {
    return this.write(this.own.map((own) => (own === bookmark ? { ...own, name: name.trim().slice(0, kMostNameChars) } : own)));
  }

  remove(bookmark: Bookmark): string | null {
    return this.write(this.own.filter((own) => own !== bookmark));
  }

  // Under a name where nothing else lies.
  private putAside(storage: BookmarkStorage, text: string): void {
    let number = 1;
    const name = (): string => `${kStored}.broken${number}`;
    while ((storage.getItem(name()) ?? text) !== text) number++;
    storage.setItem(name(), text);
  }

  private write(bookmarks: readonly Bookmark[]): string | null {
    const text = writeBookmarks(bookmarks);
    if (text.length > kMostBookmarkBytes) return `Bookmarks may take ${kMostBookmarkBytes} characters in all: save them as a file, and delete some.`;
    this.own = bookmarks;
    this.isAhead = true;
    if (this.storage === null) return kForbidden;
    try {
      if (this.broken !== null) this.putAside(this.storage, this.broken);
      this.broken = null;
      this.storage.setItem(kStored, text);
      this.isAhead = false;
      return null;
    } catch (error) {
      return error instanceof DOMException && error.name === "QuotaExceededError" ? kFull : kForbidden;
    }
  }
}

// Those that can be read of what was kept, and why the others cannot.
function readable(text: string): { readonly bookmarks: readonly Bookmark[]; readonly faults: readonly string[] } {
  const [bookmarks, faults]: [Bookmark[], string[]] = [[], []];
  const attempt = (act: () => void): void => {
    try {
      act();
    } catch (error) {
      if (!(error instanceof FormatError)) throw error;
      faults.push(error.message);
    }
  };
  attempt(() => itemsOf(text).forEach((item, i) => attempt(() => bookmarks.push(bookmarkOf(item, `bookmarks[${i}]`)))));
  return { bookmarks, faults };
}

const kForbidden = "This browser keeps nothing for this page: bookmarks last until it is closed. Save them as a file to keep them.";
const kFull = "This browser has no more room for this page: the last change lasts until it is closed. Save the bookmarks as a file, and delete some.";
