/// Files through a door: what people bring, and the scene as a file.
#pragma once

#include <optional>
#include <string_view>

#include "server/door/DoorContext.h"

namespace tessera {

inline constexpr std::string_view kUploadPath = "/upload", kUploadPrefix = "/upload/";

/// What may be done with such a path: "GET", or "PUT, DELETE"; empty: it is none of these.
[[nodiscard]] std::string_view methodOfFile(std::string_view path);
[[nodiscard]] inline bool isFilePath(std::string_view path) {
    return !methodOfFile(path).empty();
}
/// One of several methods.
[[nodiscard]] bool takesFile(std::string_view path, std::string_view method);
/// Its body is a file.
[[nodiscard]] bool isUpload(const HttpRequest& request);
/// Why somebody whom the gate has let in may not, before a body is there.
[[nodiscard]] std::optional<HttpAnswer> fileRefusal(const HttpRequest& request, const HttpTarget& target,
                                                    const Entrant& who, const DoorContext& context);
/// What has no body.
void answerFile(const HttpRequest& request, const HttpTarget& target, const Entrant& who, DoorContext& context,
                const AnswerHttp& answer);

/// Nothing: there is a place among those who bring files.
[[nodiscard]] std::optional<HttpAnswer> noPlaceForUpload(const Entrant& who, const DoorContext& context);
/// 201 with the path that a load names.
[[nodiscard]] HttpAnswer uploadedAnswer(const std::string& path, std::uint64_t bytes);

}  // namespace tessera
