// SPDX-License-Identifier: Apache-2.0
#include "server/http/problem.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <new>

#include "protocol/json_text.h"
#include "server/base/volume_error.h"
#include "view/device_info.h"
#include "view/view.h"
#include "volume/error.h"

namespace blockwalk {

HttpReply failureReply(const Problem& problem) {
  HttpReply reply = problemReply(problem);
  if (problem.status == 503 || problem.status == 429) reply.fields.emplace_back("Retry-After", "1");
  return reply;
}

Problem problemOf(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const ProblemError& thrown) {
    return thrown.problem;
  } catch (const ViewError& thrown) {
    return {.status = 400, .detail = thrown.what(), .field = thrown.field};
  } catch (const JsonError& thrown) {
    return {.status = 400, .detail = thrown.what(), .field = thrown.field.empty() ? "body" : thrown.field};
  } catch (const VolumeError& thrown) {
    return {.status = 503, .detail = fmt::format("the volume failed: {}", thrown.what()), .field = {}};
  } catch (const OutOfDeviceMemory& thrown) {
    return {.status = 503,
            .detail = fmt::format("the device has too little memory: {}", thrown.what()),
            .field = thrown.field};
  } catch (const DeviceError& thrown) {
    spdlog::error("device: {}", thrown.what());
    return {.status = 503, .detail = fmt::format("the device refused: {}", thrown.what()), .field = {}};
  } catch (const std::bad_alloc&) {
    spdlog::error("out of memory");
    return {.status = 503, .detail = "the server is out of memory", .field = {}};
  } catch (const std::exception& thrown) {
    spdlog::error("request failed: {}", thrown.what());
    return {.status = 500, .detail = thrown.what(), .field = {}};
  }
}

}  // namespace blockwalk
