// SPDX-License-Identifier: Apache-2.0
// The page as somebody in a laboratory goes through it, against the real daemon: a test for each thing that viewers of
// volumes are compared by, done by mouse and keys, told by numbers that are known. BLOCKWALK_BIN is the folder of the two
// programs, BLOCKWALK_DATA that of real volumes; BLOCKWALK_SCREENSHOTS keeps the page at three sizes.

import "./rows_look";
import "./rows_space";
import "./rows_use";
