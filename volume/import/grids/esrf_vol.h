// SPDX-License-Identifier: Apache-2.0
// .vol of PyHST, the ESRF's reconstruction: floats, described by a .vol.info or a .vol.xml beside them.
#pragma once

#include <string_view>

namespace blockwalk {

bool startsLikeEsrfInfo(std::string_view text);
bool startsLikeEsrfXml(std::string_view text);

}  // namespace blockwalk
