// SPDX-License-Identifier: Apache-2.0
// What a view of a level takes on the device, for those who are not of the renderer.
#pragma once

#include "renderer/plan/level_needs.h"  // IWYU pragma: export
