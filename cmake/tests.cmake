# SPDX-License-Identifier: Apache-2.0
# One test program a room; tests/ mirrors the folders. Every gtest case is a ctest test, but for a room that runs whole or
# in PARTS ("name=gtest filter", and a last one, `rest`, of what is in none): the cases of one process share scenes and
# kernels, which a process each would build and compile again and again. SHARES: sources of other rooms.
find_package(GTest REQUIRED)

include(GoogleTest)

function(add_room_test room)
  cmake_parse_arguments(ARG "DRAWS;WHOLE" "TIMEOUT" "LIBRARIES;SHARES;PARTS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS tests/${room}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${room} ${sources} ${ARG_SHARES})
  if(BLOCKWALK_SANITIZE)
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 3")
  endif()
  # Drivers and layers keep memory for the life of the process and are unloaded before leaks are looked for, so that those
  # cannot be told from ours: where Vulkan runs, leaks are the validation layers' to find.
  set(sanitizer_properties)
  if(ARG_DRAWS AND BLOCKWALK_SANITIZE MATCHES thread)
    set(sanitizer_properties ENVIRONMENT TSAN_OPTIONS=suppressions=${CMAKE_CURRENT_SOURCE_DIR}/tests/tsan.supp)
  elseif(ARG_DRAWS)
    set(sanitizer_properties ENVIRONMENT ASAN_OPTIONS=detect_leaks=0)
  endif()
  target_link_libraries(test_${room} PRIVATE ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main)
  # What computes is in the libraries; -O3 adds a third to the build time of tests. At -O1 GCC 12 takes a coroutine frame's
  # operator delete for another's.
  target_compile_options(test_${room} PRIVATE $<$<CONFIG:Release>:-O1>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-mismatched-new-delete>)
  target_compile_definitions(test_${room} PRIVATE BLOCKWALK_SOURCE_DIR="${CMAKE_CURRENT_SOURCE_DIR}"
    BLOCKWALK_BINARY_DIR="${CMAKE_CURRENT_BINARY_DIR}")
  if(ARG_WHOLE)
    set(parts all=*)
  elseif(ARG_PARTS)
    list(TRANSFORM ARG_PARTS REPLACE "^[^=]*=" "" OUTPUT_VARIABLE filters)
    list(JOIN filters ":" filters)
    set(parts ${ARG_PARTS} "rest=-${filters}")
  endif()
  foreach(part IN LISTS parts)
    string(REGEX MATCH "^([^=]*)=(.*)$" matched "${part}")
    add_test(NAME ${room}.${CMAKE_MATCH_1} COMMAND test_${room} "--gtest_filter=${CMAKE_MATCH_2}")
    # The longest come first, so that none runs on alone.
    set_tests_properties(${room}.${CMAKE_MATCH_1} PROPERTIES TIMEOUT ${ARG_TIMEOUT} COST ${ARG_TIMEOUT} LABELS ${room}
      ${sanitizer_properties})
  endforeach()
  if(parts)
    return()
  endif()
  gtest_discover_tests(test_${room} TEST_PREFIX ${room}. DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES
    PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS ${room} ${sanitizer_properties})
endfunction()

add_room_test(house TIMEOUT 60 LIBRARIES flags fmt::fmt)
add_room_test(volume TIMEOUT 300 LIBRARIES volume ZLIB::ZLIB BZip2::BZip2 PNG::PNG TIFF::TIFF PkgConfig::XXHASH
  PkgConfig::ZSTD PkgConfig::LZ4 PkgConfig::BLOSC PkgConfig::TURBOJPEG PkgConfig::WEBPMUX PkgConfig::OPENJPEG GIF::GIF nlohmann_json::nlohmann_json)
if(TARGET test_volume AND HDF5_FOUND)
  target_include_directories(test_volume SYSTEM PRIVATE ${HDF5_INCLUDE_DIRS})
  target_link_libraries(test_volume PRIVATE ${HDF5_LINK_LIBRARIES})
  target_compile_definitions(test_volume PRIVATE BLOCKWALK_HDF5)
endif()
# Files that other programs' own writers make, where those are there.
set(vdb_tests ${CMAKE_CURRENT_SOURCE_DIR}/tests/volume/import/vdb)
set(nanovdb_tests ${vdb_tests}/nanovdb_test.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/tests/volume/export/nanovdb_test.cpp)
find_path(NANOVDB_INCLUDES nanovdb/NanoVDB.h)
if(openvdb_libraries)
  target_include_directories(test_volume SYSTEM PRIVATE ${OPENVDB_INCLUDES})
  target_link_libraries(test_volume PRIVATE ${openvdb_libraries})
  set_property(SOURCE ${vdb_tests}/vdb_test.cpp APPEND PROPERTY COMPILE_DEFINITIONS BLOCKWALK_OPENVDB)
  # Its templates take twice as long to compile at -O1.
  set_property(SOURCE ${vdb_tests}/vdb_test.cpp APPEND PROPERTY COMPILE_OPTIONS -O0)
endif()
if(NANOVDB_INCLUDES)
  target_include_directories(test_volume SYSTEM PRIVATE ${NANOVDB_INCLUDES})
  set_property(SOURCE ${vdb_tests}/vdb_test.cpp ${nanovdb_tests} APPEND PROPERTY COMPILE_DEFINITIONS BLOCKWALK_NANOVDB)
endif()
set_source_files_properties(${vdb_tests}/vdb_test.cpp ${nanovdb_tests} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
add_room_test(view TIMEOUT 60 LIBRARIES view)
add_room_test(protocol TIMEOUT 120 LIBRARIES protocol PNG::PNG PkgConfig::WEBP PkgConfig::WEBPDEMUX)
# Scenes of one type of voxel draw with the same kernels.
add_room_test(renderer DRAWS TIMEOUT 2400 LIBRARIES renderer protocol reference PARTS
  "rgba8=*/rgba8:*/fossil:*/grass" "u8=*/u8_flat:*/flair" "u16=*/u16_oblique:*/head" "f32=*/f32_mirrored:*/smoke:*/fetal_t2")
add_room_test(extreme DRAWS WHOLE TIMEOUT 1800 LIBRARIES renderer protocol reference SHARES tests/renderer/stage.cpp
  tests/renderer/compare.cpp tests/renderer/synthetic.cpp)
target_include_directories(test_renderer PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/spirv)
if(BLOCKWALK_SANITIZE)
  # What a sanitizer is worth most on, and fast: bands, cancelling, refinement, building, every finder once, reading a
  # scene of each type. Whole parts take hours there.
  add_test(NAME renderer.fast COMMAND test_renderer "--gtest_filter=FramesTest.*:RefineTest.*:Plan.*:Specialise.*:\
Clusters.*:Octree*:HostWork.*:KernelInterface.*:MeshTest.NothingIs*:OutputsTest.NothingIs*:SamplesTest.Cancelling*:\
SamplesTest.DoNot*:RegionTest.MayBeEmpty:ThreeChannels.AreResident*:On/TruthTest.TheFile*/*:On/TruthTest.Blend*/u8_flat:\
On/TruthTest.Coarser*/fossil:On/TruthTest.Coarser*/smoke:On/TruthTest.Coarser*/head")
  get_test_property(renderer.rest ENVIRONMENT renderer_environment)
  set_tests_properties(renderer.fast PROPERTIES TIMEOUT 1200 COST 2000 LABELS fast ENVIRONMENT "${renderer_environment}")
endif()
add_room_test(server DRAWS TIMEOUT 300 LIBRARIES server spdlog::spdlog ZLIB::ZLIB)
add_room_test(cli DRAWS TIMEOUT 300 LIBRARIES protocol OpenSSL::SSL)
if(TARGET test_cli)
  add_dependencies(test_cli blockwalk)
endif()

# clients/python, with a daemon.
find_program(PYTHON3 python3)
if(PYTHON3 AND TARGET blockwalkd)
  add_test(NAME python.client COMMAND ${CMAKE_COMMAND} -E env BLOCKWALK_BIN=$<TARGET_FILE_DIR:blockwalkd>
    ${PYTHON3} ${CMAKE_CURRENT_SOURCE_DIR}/tests/python/client_test.py)
  set_tests_properties(python.client PROPERTIES TIMEOUT 300 LABELS python)
endif()

# Fuzz targets: with BLOCKWALK_FUZZ they are libFuzzer programs; always they run over seeds and seeded mutations.
file(GLOB fuzz_targets CONFIGURE_DEPENDS tests/fuzz/fuzz_*.cpp)
foreach(source IN LISTS fuzz_targets)
  get_filename_component(name ${source} NAME_WE)
  if(BLOCKWALK_FUZZ)
    add_executable(${name} ${source})
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer)
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  else()
    add_executable(${name} ${source} tests/fuzz/mutate.cpp)
    add_test(NAME fuzz.${name} COMMAND ${name})
    set_tests_properties(fuzz.${name} PROPERTIES TIMEOUT 120 LABELS fuzz)
  endif()
  # What a parser of the server needs beside itself is the server's.
  if(name MATCHES "chunked_body|http_head|options")
    target_link_libraries(${name} PRIVATE server)
  else()
    target_link_libraries(${name} PRIVATE protocol volume PkgConfig::XXHASH)
  endif()
endforeach()

if(HDF5_FOUND)
  target_include_directories(fuzz_import_hdf5 SYSTEM PRIVATE ${HDF5_INCLUDE_DIRS})
  target_link_libraries(fuzz_import_hdf5 PRIVATE ${HDF5_LINK_LIBRARIES})
  target_compile_definitions(fuzz_import_hdf5 PRIVATE BLOCKWALK_HDF5)
endif()
target_link_libraries(fuzz_import_picture PRIVATE PkgConfig::TURBOJPEG PkgConfig::WEBPMUX PkgConfig::OPENJPEG GIF::GIF)

# That the program measures; what it measures is for people.
if(TARGET bench)
  add_test(NAME bench.masks COMMAND bench masks --demo-side 16)
  set_tests_properties(bench.masks PROPERTIES TIMEOUT 60 LABELS bench PASS_REGULAR_EXPRESSION "\"experiment\": \"masks\"")
  add_test(NAME bench.refuses COMMAND bench frames --size 0x0 ${CMAKE_CURRENT_SOURCE_DIR}/LICENSE)
  set_tests_properties(bench.refuses PROPERTIES TIMEOUT 60 LABELS bench PASS_REGULAR_EXPRESSION "(^|\n)bench: size: ")
  add_test(NAME bench.usage COMMAND bench frames --nonsense)
  set_tests_properties(bench.usage PROPERTIES TIMEOUT 60 LABELS bench PASS_REGULAR_EXPRESSION "(^|\n)bench: [^\n]*; see bench --help")
endif()

if(BLOCKWALK_WEB)
  find_program(NODE node REQUIRED)
  # A test each of its files, one browser at a time.
  file(GLOB web_tests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/clients/web/test/*.test.ts)
  foreach(file ${web_tests})
    get_filename_component(name ${file} NAME_WE)
    add_test(NAME web.${name} COMMAND ${NODE} --test ${CMAKE_CURRENT_BINARY_DIR}/web/test/${name}.test.mjs)
    set_tests_properties(web.${name} PROPERTIES TIMEOUT 600 LABELS web)
    if(name MATCHES "^page")
      set_tests_properties(web.${name} PROPERTIES COST 600 RESOURCE_LOCK browser)
    endif()
  endforeach()
  foreach(name browser rows)
    add_test(NAME web.${name} COMMAND ${CMAKE_COMMAND} -E env BLOCKWALK_BIN=$<TARGET_FILE_DIR:blockwalkd>
      ${NODE} --test ${CMAKE_CURRENT_BINARY_DIR}/web/${name}_test.mjs)
    set_tests_properties(web.${name} PROPERTIES TIMEOUT 600 COST 600 LABELS web RESOURCE_LOCK browser)
  endforeach()
endif()
