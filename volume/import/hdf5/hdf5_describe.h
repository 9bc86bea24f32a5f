// SPDX-License-Identifier: Apache-2.0
// What libhdf5 says of objects, as JSON that hdf5_object.h reads.
#pragma once

#include "volume/import/hdf5/hdf5_driver.h"

#ifdef BLOCKWALK_HDF5
#include <nlohmann/json.hpp>
#include <string>

namespace blockwalk {

// Throws DataError that names the attribute where there is more of it than anybody needs.
nlohmann::json describeAttributes(hid_t object);

// Of a dataset: shape, type, layout, filters, fill value. Throws DataError that says what is broken.
nlohmann::json describeArray(hid_t dataset);

// Well-formed UTF-8: Latin-1 where it is not.
std::string utf8Text(std::string text);

}  // namespace blockwalk
#endif
