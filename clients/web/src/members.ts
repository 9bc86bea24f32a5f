// SPDX-License-Identifier: Apache-2.0
// Members of a view that the page passes on as text: the server knows what they may be. They are named as in the
// interface, with what the server draws where they are left out.

export const kOtherMembers = {
  step: "0.5",
  classification: "post",
  "tf-shape": "linear",
  attenuation: "0.05",
  termination: "0.0009765625",
  level: "auto",
  time: "0",
  lod: "2",
  "lod-alpha": "0",
  requests: "file",
  "stand-in": "auto",
  light: "0.3,0.4,0.3,0.2",
  "key-light": "-1,1,1",
  shadow: "off",
  occlusion: "off",
  aperture: "0",
  focus: "auto",
  finder: "auto",
  macrocell: "auto",
  walk: "on",
  cull: "on",
  samples: "1",
  quality: "85",
} as const;

export type OtherMember = keyof typeof kOtherMembers;
export type Members = { readonly [name in OtherMember]?: string };

// What takes a member back that is no more among those of a view; of others every message has a value.
export const kDefaults: Readonly<Record<string, string>> = { ...kOtherMembers, tf: "auto", clip: "none", planes: "none" };

export const otherMembers = Object.keys(kOtherMembers).filter(isOtherMember);

export function isOtherMember(name: string): name is OtherMember {
  return Object.hasOwn(kOtherMembers, name);
}

// Those that are not as the server has them anyway, in one order, so that equal ones are equal as text.
export function textOfMembers(members: Members): Members {
  return Object.fromEntries(otherMembers.flatMap((name) => {
    const text = members[name];
    return text === undefined || text === kOtherMembers[name] ? [] : [[name, text]];
  }));
}

export function withMember(members: Members, name: OtherMember, text: string | undefined): Members {
  return textOfMembers({ ...members, [name]: text });
}
