/// One line of the audit log.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/Entrant.h"

namespace tessera {

/// What somebody has done, alike and within a second: one line however often.
struct AuditLine {
    std::chrono::system_clock::time_point at;  ///< of the first time
    Entrant who;
    std::string program = {};  ///< as it calls itself
    std::string from = {};     ///< the other end's address, as the server sees it
    std::string did = {};      ///< a request's name
    std::uint64_t times = 1;
    std::uint64_t changes = 0;              ///< to fields, places and objects, in all
    std::vector<std::string> objects = {};  ///< that were written, or that the request named; not all where many were
    std::string refused = {};               ///< why it was not done; empty: it was
};

/// Without a line's end. Bytes that are no UTF-8 are replaced; controls (common/base/Controls.h) stand as numbers.
[[nodiscard]] std::string toJson(const AuditLine& line);

}  // namespace tessera
