// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstdint>

namespace blockwalk {

// Whom shares are given to, whatever the number of connections: an IPv4 address, or the /64 of an IPv6 one, which is
// what one customer has. All who know the token know the same one, so it tells nobody apart. 0 is the server itself.
inline std::uint64_t peerOf(const boost::asio::ip::address& address) {
  constexpr std::uint64_t kIpv4 = std::uint64_t{1} << 32;  // no /64 that is routed begins with zeros
  if (address.is_v4()) return kIpv4 | address.to_v4().to_uint();
  const auto v6 = address.to_v6();
  if (v6.is_v4_mapped()) return kIpv4 | make_address_v4(boost::asio::ip::v4_mapped, v6).to_uint();
  std::uint64_t prefix = 0;
  for (std::size_t i = 0; i < 8; ++i) prefix = prefix << 8 | v6.to_bytes()[i];
  return prefix == 0 ? 1 : prefix;  // ::1
}

}  // namespace blockwalk
