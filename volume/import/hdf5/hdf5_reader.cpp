// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_reader.h"

#ifdef BLOCKWALK_HDF5
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <vector>

#include "volume/error.h"
#include "volume/import/hdf5/hdf5_describe.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kMostQuestionBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMostMembers = 200000;
constexpr std::size_t kMostVisited = 50000;
constexpr std::size_t kMostDatasets = 256;
constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 20;

std::string answerOf(char kind, std::string_view content) {
  std::string answer(1, kind);
  answer += content;
  return answer;
}

struct Visit {
  nlohmann::json datasets = nlohmann::json::array();
  std::size_t visited = 0;
};

herr_t addMember(hid_t /*group*/, const char* name, const H5L_info_t* /*info*/, void* to) {
  auto& members = *static_cast<nlohmann::json*>(to);
  members.push_back(utf8Text(name));
  return members.size() < kMostMembers ? 0 : 1;
}

herr_t addDataset(hid_t root, const char* name, const H5O_info_t* info, void* to) {
  auto& visit = *static_cast<Visit*>(to);
  if (++visit.visited > kMostVisited || visit.datasets.size() >= kMostDatasets) return 1;
  if (info->type != H5O_TYPE_DATASET) return 0;
  const Hdf5Handle dataset(H5Dopen2(root, name, H5P_DEFAULT), H5Dclose);
  if (!dataset.isOpen()) return 0;
  try {
    nlohmann::json array = describeArray(dataset.get());
    if (array["shape"].size() < 2) return 0;
    visit.datasets.push_back({{"path", utf8Text(name)},
                              {"attributes", nlohmann::json::object()},
                              {"members", nlohmann::json::array()},
                              {"array", std::move(array)}});
  } catch (const DataError&) {
    return 0;  // one that is broken may lie beside the one that is meant
  }
  return 0;
}

class Hdf5Reader {
 public:
  explicit Hdf5Reader(const InputFile& file) : file_(openWithDriver(file)), dataset_(-1, H5Oclose) {}

  std::string answer(const std::string& question) {
    try {
      if (!file_.isOpen()) failData("is no HDF5 file that libhdf5 can open: it is broken or cut off");
      return answerTo(nlohmann::json::parse(question));
    } catch (const std::exception& error) {
      return answerOf('e', error.what());
    }
  }

 private:
  std::string answerTo(const nlohmann::json& question) {
    const auto path = question.at("path").get<std::string>();
    const auto ask = question.at("ask").get<std::string>();
    if (ask == "datasets") return answerOf('j', datasets().dump());
    if (!isThere(path)) return answerOf('n', {});
    const Hdf5Handle& object = open(path);
    if (ask == "object") return answerOf('j', describe(path, object.get()).dump());
    if (H5Iget_type(object.get()) != H5I_DATASET) failData("'{}' is no dataset", path);
    if (ask == "numbers") return answerOf('b', numbers(object.get()));
    if (ask == "bytes") return answerOf('b', compactBytes(object.get()));
    return answerOf('b', chunks(object.get(), question));
  }

  // Links of every part of the path: those to other files are not followed.
  bool isThere(const std::string& path) {
    for (std::size_t end = 0; end < path.size();) {
      end = std::min(path.find('/', end + 1), path.size());
      const std::string part = path.substr(0, end);
      if (H5Lexists(file_.get(), part.c_str(), H5P_DEFAULT) <= 0) return false;
      H5L_info_t link{};
      if (H5Lget_info(file_.get(), part.c_str(), &link, H5P_DEFAULT) < 0) failData("'{}': its link is broken", part);
      if (link.type == H5L_TYPE_EXTERNAL) {
        failData("'{}' is an external link; other files are not followed: import that file itself", part);
      }
    }
    return true;
  }

  const Hdf5Handle& open(const std::string& path) {
    if (dataset_.isOpen() && path == dataset_path_) return dataset_;
    dataset_ = Hdf5Handle(H5Oopen(file_.get(), path.empty() ? "/" : path.c_str(), H5P_DEFAULT), H5Oclose);
    dataset_path_ = path;
    if (!dataset_.isOpen()) {
      failData("{} cannot be opened: it is broken, or links to what is not in this file",
               path.empty() ? "its root" : fmt::format("'{}'", path));
    }
    return dataset_;
  }

  nlohmann::json describe(const std::string& path, hid_t object) {
    try {
      nlohmann::json said = {{"path", path}, {"members", nlohmann::json::array()}};
      said["attributes"] = describeAttributes(object);
      if (H5Iget_type(object) == H5I_DATASET) said["array"] = describeArray(object);
      if (H5Iget_type(object) == H5I_GROUP) {
        hsize_t at = 0;
        if (H5Literate(object, H5_INDEX_NAME, H5_ITER_INC, &at, addMember, &said["members"]) < 0) {
          failData("its list of members is broken");
        }
      }
      return said;
    } catch (const DataError& error) {
      failData("'{}': {}", path, error.what());
    }
  }

  nlohmann::json datasets() {
    Visit visit;
    if (H5Ovisit(file_.get(), H5_INDEX_NAME, H5_ITER_INC, addDataset, &visit) < 0 && visit.datasets.empty()) {
      failData("its groups are broken");
    }
    return visit.datasets;
  }

  std::uint64_t samplesOf(hid_t dataset) {
    const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
    const hssize_t count = space.isOpen() ? H5Sget_simple_extent_npoints(space.get()) : -1;
    return count < 0 ? UINT64_MAX : static_cast<std::uint64_t>(count);
  }

  // H5Dread follows external files and virtual datasets.
  void requireOwnVoxels(hid_t dataset) const {
    const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
    if (!properties.isOpen()) failData("'{}': its layout is broken", dataset_path_);
    const H5D_layout_t layout = H5Pget_layout(properties.get());
    const bool is_own = layout == H5D_COMPACT || layout == H5D_CHUNKED || layout == H5D_CONTIGUOUS;
    if (!is_own || H5Pget_external_count(properties.get()) != 0) {
      failData("'{}' lies in other files, which are not followed", dataset_path_);
    }
  }

  std::string numbers(hid_t dataset) {
    requireOwnVoxels(dataset);
    const std::uint64_t count = samplesOf(dataset);
    if (count > kMostNumbers) failData("'{}' has more than {} numbers", dataset_path_, kMostNumbers);
    std::string bytes(count * sizeof(double), '\0');
    if (count > 0 && H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) {
      failData("'{}': its numbers cannot be read", dataset_path_);
    }
    return bytes;
  }

  // Of a compact dataset, as they are in the file.
  std::string compactBytes(hid_t dataset) {
    constexpr std::uint64_t kMostCompactBytes = 65536;
    requireOwnVoxels(dataset);
    const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
    const std::size_t width = type.isOpen() ? H5Tget_size(type.get()) : 0;
    const std::uint64_t count = samplesOf(dataset);
    if (width == 0 || count > kMostCompactBytes / width) failData("'{}': its layout is broken", dataset_path_);
    std::string bytes(count * width, '\0');
    if (H5Dread(dataset, type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0) {
      failData("'{}': its bytes cannot be read", dataset_path_);
    }
    return bytes;
  }

  // Chunks `begin` up to and without `end` of those that lie `count` on each axis from chunk `first` on.
  std::string chunks(hid_t dataset, const nlohmann::json& question) {
    const auto chunk = question.at("chunk").get<std::vector<hsize_t>>();
    const auto first = question.at("first").get<std::vector<hsize_t>>();
    const auto count = question.at("count").get<std::vector<hsize_t>>();
    const auto begin = question.at("begin").get<std::uint64_t>();
    const auto end = question.at("end").get<std::uint64_t>();
    std::vector<Hdf5Place> places;
    std::vector<hsize_t> corner(chunk.size());
    for (std::uint64_t i = begin; i < end; ++i) {
      std::uint64_t left = i;
      for (std::size_t axis = chunk.size(); axis-- > 0; left /= count[axis]) {
        corner[axis] = (first[axis] + left % count[axis]) * chunk[axis];
      }
      const auto place = placeOfChunk(dataset, corner.data());
      if (!place) failData("'{}': its index of chunks is broken", dataset_path_);
      places.push_back(*place);
    }
    std::string bytes(places.size() * sizeof(Hdf5Place), '\0');
    std::memcpy(bytes.data(), places.data(), bytes.size());
    return bytes;
  }

  Hdf5Handle file_;
  Hdf5Handle dataset_;  // the object that was asked about last
  std::string dataset_path_;
};

// Broken files can send libhdf5 round and round: the process ends where one answer takes so long. Waiting for a disk is
// no part of it.
void limitSeconds() {
  constexpr rlim_t kMostSeconds = 5;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto so_far = static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const rlimit limit{so_far + 1 + kMostSeconds, RLIM_INFINITY};
  setrlimit(RLIMIT_CPU, &limit);
}

}  // namespace

bool canReadHdf5() { return true; }

void serveHdf5(int socket, const InputFile& file) {
  limitSeconds();
  Hdf5Reader reader(file);
  while (const auto question = receiveHdf5Message(socket, kMostQuestionBytes, -1)) {
    limitSeconds();
    if (!sendHdf5Message(socket, reader.answer(*question))) return;
  }
}

}  // namespace blockwalk

#else

namespace blockwalk {

bool canReadHdf5() { return false; }

void serveHdf5(int /*socket*/, const InputFile& /*file*/) {}

}  // namespace blockwalk

#endif
