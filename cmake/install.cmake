# SPDX-License-Identifier: Apache-2.0
# `cmake --install` gives a tree that runs when copied to another machine: bin/, lib/ with every shared library
# beyond libc, libstdc++ and the Vulkan loader, share/blockwalk/web. Found through RPATH $ORIGIN/../lib.
install(TARGETS blockwalk blockwalkd RUNTIME_DEPENDENCY_SET runtime_dependencies DESTINATION ${CMAKE_INSTALL_BINDIR})
install(RUNTIME_DEPENDENCY_SET runtime_dependencies
  PRE_EXCLUDE_REGEXES "^ld-linux" "^libc\\.so" "^libm\\.so" "^libdl\\.so" "^libpthread\\.so" "^librt\\.so"
    "^libstdc\\+\\+" "^libgcc_s" "^libvulkan\\.so"
  DESTINATION ${CMAKE_INSTALL_LIBDIR})
