// SPDX-License-Identifier: Apache-2.0
// The tools that have a panel or a list of their own, as one: what is told to one of them is told to all.

import { BookmarkList } from "./bookmark_list";
import { byId } from "./dom";
import { LabelTable } from "./label_table";
import { TransferEditor } from "./transfer_editor";
import type { Toasts } from "./toasts";
import { withTransfer, type ViewChange, type ViewState } from "./view_state";
import type { ChannelInfo, VolumeInfo } from "./volume_info";

export class Panels {
  readonly editor: TransferEditor;
  readonly bookmarks: BookmarkList;
  private readonly labels = byId("labels", HTMLElement);
  private readonly template = byId("label-list", HTMLTemplateElement);
  private tables: readonly { readonly number: number; readonly table: LabelTable }[] = []; // of channels of labels
  private view: ViewState | null = null;

  constructor(private readonly onChange: (change: ViewChange) => void, imageAddress: (id: string) => string, private readonly toasts: Toasts) {
    this.editor = new TransferEditor(onChange, imageAddress, toasts);
    this.bookmarks = new BookmarkList(toasts);
  }

  setVolume(volume: VolumeInfo): void {
    this.view = null;
    this.editor.setVolume(volume);
    this.bookmarks.setVolume(volume);
    const { channels } = volume;
    this.tables = channels.flatMap((channel, number) => (channel.areLabels && channel.transfer !== null ? [{ number, table: this.table(channel, number, channels.length === 1) }] : []));
    this.labels.replaceChildren(...this.tables.map(({ table }) => table.element));
  }

  show(view: ViewState): void {
    this.view = view;
    this.editor.show(view);
    this.bookmarks.show(view);
    for (const { number, table } of this.tables) table.show(view.transfers[number] ?? "auto");
  }

  // Nothing is open.
  clear(): void {
    this.editor.close();
  }

  private table(channel: ChannelInfo, number: number, isAlone: boolean): LabelTable {
    const change = (transfer: string): void => {
      if (this.view !== null) this.onChange(withTransfer(this.view, number, transfer));
    };
    return new LabelTable(this.template, channel, isAlone, change, (detail) => this.toasts.show({ title: "They cannot be hidden", detail, field: "tf" }));
  }
}
