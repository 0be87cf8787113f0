#include "server/door/SceneCopies.h"

#include <fmt/format.h>

#include <exception>
#include <thread>

#include "common/application/Connection.h"
#include "common/base/Clock.h"
#include "common/base/StartThread.h"
#include "common/scene/Aspect.h"
#include "server/door/Routes.h"
#include "server/door/UploadFolder.h"

namespace tessera {
namespace {

Expected<Aspect> follow(ConnectionOptions options, TimePoint deadline, const std::atomic<bool>& stops) {
    Connection connection(std::move(options));
    Aspect scene;
    Sequence current;
    constexpr std::chrono::milliseconds kLook{100};
    while (!stops && std::chrono::steady_clock::now() < deadline) {
        const std::optional<Incoming> came = connection.next(std::chrono::steady_clock::now() + kLook);
        if (!came) continue;
        if (const auto* ended = std::get_if<incoming::Ended>(&*came))
            return tl::unexpected(ended->over ? Error{ErrorCode::kNetwork, "the server is over"} : ended->error);
        const auto* list = std::get_if<incoming::List>(&*came);
        if (list == nullptr) continue;
        if (list->whole) {
            scene = Aspect();
            current = list->current;
        }
        if (const Expected<void> applied = scene.apply(*list->list); !applied) return tl::unexpected(applied.error());
        if (list->committed->sequence >= current) return scene;
    }
    return fail(ErrorCode::kNetwork, "the scene has not come in time");
}

std::uint64_t arrayBytes(const Aspect& scene) {
    std::uint64_t bytes = 0;
    for (const Blob& array : blobsOf(snapshot(scene))) bytes += array.sizeBytes();
    return bytes;
}

Expected<std::shared_ptr<const AnswerFile>> copied(const ConnectionOptions& options, SceneEncoding encoding,
                                                   const std::string& folder, const std::atomic<bool>& stops) {
    const TimePoint deadline = std::chrono::steady_clock::now() + SceneCopies::kPatience;
    // How much it is is known without its arrays.
    ConnectionOptions light = options;
    light.blobs = false;
    const Expected<Aspect> sketch = follow(light, deadline, stops);
    if (!sketch) return tl::unexpected(sketch.error());
    if (const std::uint64_t bytes = arrayBytes(*sketch); bytes > SceneCopies::kMaxArrayBytes)
        return fail(
            ErrorCode::kLimit,
            fmt::format("the scene has {} MiB of arrays, and {} may be saved here: `tessera-ctl save` takes more",
                        bytes >> 20, SceneCopies::kMaxArrayBytes >> 20));
    const Expected<Aspect> scene = follow(options, deadline, stops);
    if (!scene) return tl::unexpected(scene.error());
    const Expected<std::string> bytes = writeScene(*scene, encoding);
    if (!bytes) return tl::unexpected(bytes.error());
    Expected<FileHandle> file = namelessFile(folder);
    if (!file) return tl::unexpected(file.error());
    if (const Expected<void> written = writeNameless(*file, std::as_bytes(std::span(*bytes))); !written)
        return tl::unexpected(written.error());
    return std::make_shared<const AnswerFile>(AnswerFile{std::move(*file), bytes->size()});
}

}  // namespace

void SceneCopies::ask(const Address& server, const std::string& word, SceneEncoding encoding, const std::string& folder,
                      const AnswerHttp& answer) {
    if (busy_) {
        HttpAnswer later = errorAnswer(503, "limit", "the scene is being saved for somebody already: try again");
        later.fields.emplace_back("Retry-After", "2");
        return answer(std::move(later));
    }
    busy_ = true;
    ConnectionOptions options;
    options.address = server;
    options.name = "console";
    options.access = [word](const std::string&) { return word; };
    options.blobs = true;
    const auto work = [options, encoding, folder, this] {
        Expected<std::shared_ptr<const AnswerFile>> made = fail(ErrorCode::kFailed, "nothing was made");
        // Its heap goes with it.
        std::thread apart = startThread([&] {
            standBehindFrames();
            try {
                made = copied(options, encoding, folder, stops_);
            } catch (const std::exception& shortage) {  // of threads, descriptors or memory
                made = fail(ErrorCode::kLimit, fmt::format("the machine has no room for it: {}", shortage.what()));
            }
        });
        if (!apart.joinable()) return made = fail(ErrorCode::kLimit, kNoThread);
        apart.join();
        return made;
    };
    writer_.run(work, [this, encoding, answer](const Expected<std::shared_ptr<const AnswerFile>>& made) {
        busy_ = false;
        if (!made) return answer(apiErrorAnswer({made.error().code, made.error().message}));
        HttpAnswer file{.type = "application/octet-stream", .body = {}, .file = *made};
        file.fields.emplace_back("Content-Disposition", fmt::format("attachment; filename=\"scene.{}\"",
                                                                    encoding == SceneEncoding::kText ? "tsct" : "tsc"));
        answer(std::move(file));
    });
}

}  // namespace tessera
