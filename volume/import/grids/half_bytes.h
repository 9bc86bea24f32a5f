// SPDX-License-Identifier: Apache-2.0
// An array of 16-bit floats as one of 32-bit floats.
#pragma once

#include <memory>

#include "volume/import/byte_reader.h"

namespace blockwalk {

// Of this machine's byte order; `swap_bytes`: the halves are not. What is read are whole floats.
std::unique_ptr<ByteReader> floatsOfHalves(std::unique_ptr<ByteReader> halves, bool swap_bytes);

}  // namespace blockwalk
