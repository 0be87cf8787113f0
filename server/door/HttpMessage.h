/// What a request over HTTP says, and what is answered, without the library that reads and writes them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/FileHandle.h"
#include "common/base/Identity.h"

namespace tessera {

struct HttpRequest {
    std::string method;
    std::string target;  ///< as it came: path and query
    std::string host, origin, authorization, contentType;
    bool wantsSocket = false;  ///< an upgrade to a WebSocket
    std::string body;
    std::optional<std::uint64_t> length = {};  ///< of the body, as its head says
    std::optional<Credential> key = {};        ///< whom its sender has proved to be; none: nobody
    std::string from = {};                     ///< its sender's address
};

/// What is too large to be held: read piece by piece as it is sent.
struct AnswerFile {
    FileHandle handle;
    std::uint64_t bytes = 0;
};

struct HttpAnswer {
    int status = 200;
    std::string type = "application/json";
    std::string body;
    std::vector<std::pair<std::string, std::string>> fields = {};  ///< of the head, beside those that all have
    std::shared_ptr<const AnswerFile> file = {};                   ///< instead of the body; null: there is none
};
using AnswerHttp = std::function<void(HttpAnswer)>;

/// A target taken apart, its %xx and + replaced.
struct HttpTarget {
    std::string path;
    std::map<std::string, std::string> query;  ///< the first of each name
};
/// Nothing: it does not begin with /, or a %xx is none, or it would stand for a control character.
[[nodiscard]] std::optional<HttpTarget> readTarget(std::string_view target);

}  // namespace tessera
