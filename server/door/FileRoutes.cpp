#include "server/door/FileRoutes.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/json/Json.h"
#include "server/door/Routes.h"

namespace tessera {
namespace {

constexpr std::string_view kSceneBinary = "/scene.tsc", kSceneText = "/scene.tsct";

HttpAnswer refused(const Error& error) {
    return apiErrorAnswer({error.code, error.message});
}

void tellUsed(DoorContext& context, const AnswerHttp& answer) {
    const std::shared_ptr<UploadFolder> folder = context.options.uploads;
    context.disk->run([folder] { return folder->used(); },
                      [folder, answer](const UploadFolder::Used& used) {
                          answer({.body = jsonText(Json{{"folder", folder->path()},
                                                        {"bytes", used.bytes},
                                                        {"most_bytes", folder->limits().maxBytes},
                                                        {"files", used.files},
                                                        {"most_files", folder->limits().maxFiles}}) +
                                          "\n"});
                      });
}

void removeFile(const std::string& name, const Entrant& who, DoorContext& context, const AnswerHttp& answer) {
    const std::shared_ptr<UploadFolder> folder = context.options.uploads;
    context.disk->run([folder, name] { return folder->remove(name); },
                      [folder, name, who, answer, onFile = context.options.onFile](const Expected<void>& removed) {
                          if (!removed) return answer(refused(removed.error()));
                          if (onFile) onFile(who, "RemoveFile", folder->path() + "/" + name);
                          answer({.body = "{}\n"});
                      });
}

}  // namespace

std::string_view methodOfFile(std::string_view path) {
    if (path.starts_with(kUploadPrefix)) return "PUT, DELETE";
    return path == kUploadPath || path == kSceneBinary || path == kSceneText ? "GET" : "";
}

bool takesFile(std::string_view path, std::string_view method) {
    return path.starts_with(kUploadPrefix) && (method == "PUT" || method == "DELETE");
}

bool isUpload(const HttpRequest& request) {
    const std::optional<HttpTarget> target = readTarget(request.target);
    return request.method == "PUT" && target && target->path.starts_with(kUploadPrefix);
}

std::optional<HttpAnswer> fileRefusal(const HttpRequest& request, const HttpTarget& target, const Entrant& who,
                                      const DoorContext& context) {
    if (!isFilePath(target.path)) return std::nullopt;
    if (!who.panel.empty()) return errorAnswer(403, "refused", "a panel's token brings no files, and sees none");
    const bool saves = !target.path.starts_with(kUploadPath);
    const Role least = saves ? Role::kEditor : Role::kOperator;
    if (who.role < least)
        return errorAnswer(
            403, "refused",
            fmt::format("{} wants the role {}; this is a {}", saves ? "to save the scene" : "to bring files",
                        nameOf(least), nameOf(who.role)));
    if (saves) return std::nullopt;
    if (!context.options.uploads) return errorAnswer(501, "unsupported", "this server takes no files");
    if (target.path == kUploadPath) return std::nullopt;
    const Expected<std::vector<std::string>> names =
        uploadNames(std::string_view(target.path).substr(kUploadPrefix.size()));
    if (!names) return refused(names.error());
    if (request.method != "PUT") return std::nullopt;
    if (!request.length) return errorAnswer(411, "refused", "a file comes with its Content-Length");
    if (*request.length == 0) return errorAnswer(400, "bad_input", "the file is empty");
    const std::uint64_t most = context.options.uploads->limits().maxBytes;
    if (*request.length > most)
        return errorAnswer(413, "limit",
                           fmt::format("the file has {} MiB; uploads may have {} together (--uploads-mib)",
                                       *request.length >> 20, most >> 20));
    return std::nullopt;
}

void answerFile(const HttpRequest& request, const HttpTarget& target, const Entrant& who, DoorContext& context,
                const AnswerHttp& answer) {
    if (target.path == kUploadPath) return tellUsed(context, answer);
    if (target.path.starts_with(kUploadPrefix) && request.method == "DELETE")
        return removeFile(target.path.substr(kUploadPrefix.size()), who, context, answer);
    const auto& folder = context.options.uploads;
    context.copies.ask(context.options.server, context.options.tokens.ofDoorFor(who),
                       target.path == kSceneText ? SceneEncoding::kText : SceneEncoding::kBinary,
                       folder ? folder->path() : std::string(), answer);
}

std::optional<HttpAnswer> noPlaceForUpload(const Entrant& who, const DoorContext& context) {
    std::size_t own = 0, others = 0;
    for (const Guest* guest : context.guests)
        if (guest->isUploading && guest->who) ++(guest->who->isSameAs(who) ? own : others);
    if (hasShare(who.by, own, others, context.limits.maxUploads)) return std::nullopt;
    HttpAnswer later = errorAnswer(503, "limit", "as many files are on their way as may be: try again");
    later.fields.emplace_back("Retry-After", "2");
    return later;
}

HttpAnswer uploadedAnswer(const std::string& path, std::uint64_t bytes) {
    return {.status = 201, .body = jsonText(Json{{"path", path}, {"bytes", bytes}}) + "\n"};
}

}  // namespace tessera
