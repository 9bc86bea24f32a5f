# SPDX-License-Identifier: Apache-2.0
# Headers that are read once a target instead of once a file: the dear ones of the standard library and of dependencies.
# Every file still includes what it uses; -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON builds without.
set(precompiled_standard <algorithm> <array> <chrono> <cmath> <cstdint> <cstring> <filesystem> <functional> <memory>
  <optional> <span> <string> <utility> <vector> <fmt/format.h> <glm/glm.hpp>)
set(precompiled_json ${precompiled_standard} <nlohmann/json.hpp>)
set(precompiled_tests ${precompiled_json} <gmock/gmock.h> <gtest/gtest.h>)

target_precompile_headers(volume PRIVATE ${precompiled_standard})
target_precompile_headers(reference PRIVATE ${precompiled_standard})
target_precompile_headers(renderer PRIVATE ${precompiled_standard} <vulkan/vulkan_raii.hpp>)
target_precompile_headers(protocol PRIVATE ${precompiled_json})
target_precompile_headers(server PRIVATE ${precompiled_json} <spdlog/spdlog.h> <boost/asio/awaitable.hpp>
  <boost/asio/co_spawn.hpp> <boost/asio/ip/tcp.hpp> <boost/asio/ssl.hpp> <boost/asio/steady_timer.hpp>
  <boost/asio/use_awaitable.hpp> <boost/beast/core.hpp> <boost/beast/http.hpp> <boost/beast/websocket.hpp>)
target_precompile_headers(experiments PRIVATE ${precompiled_json})
target_precompile_headers(blockwalk PRIVATE ${precompiled_json})
