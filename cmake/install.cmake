# SPDX-License-Identifier: Apache-2.0
# `cmake --install` gives a tree that runs when copied to another machine: bin/, lib/ with every shared library
# beyond libc, libstdc++ and the Vulkan loader, share/blockwalk/web. Found through RPATH $ORIGIN/../lib.
# RPATH and not RUNPATH: it also serves what the libraries need of each other.
target_link_options(blockwalk PRIVATE LINKER:--disable-new-dtags)
target_link_options(blockwalkd PRIVATE LINKER:--disable-new-dtags)
install(TARGETS blockwalk blockwalkd RUNTIME_DEPENDENCY_SET runtime_dependencies DESTINATION ${CMAKE_INSTALL_BINDIR})
install(RUNTIME_DEPENDENCY_SET runtime_dependencies
  PRE_EXCLUDE_REGEXES "^ld-linux" "^libc\\.so" "^libm\\.so" "^libdl\\.so" "^libpthread\\.so" "^librt\\.so"
    "^libstdc\\+\\+" "^libgcc_s" "^libvulkan\\.so"
  DESTINATION ${CMAKE_INSTALL_LIBDIR})
