#include "server/import/InlineCores.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "common/cores/Inline.h"
#include "common/cores/ProxyGroup.h"
#include "common/drawable/Drawable.h"
#include "server/import/AssetFolders.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

using InlineMessage = proto::scene::Inline;
static_assert(InlineMessage::AT_ONCE == LoadWords::kAtOnce && InlineMessage::NEAR == LoadWords::kNear &&
              InlineMessage::BY_HAND == LoadWords::kByHand);

template <typename T>
Expected<T> readNamed(const google::protobuf::Message& message, const LoadedFile& file,
                      std::span<const std::string> importing) {
    if (!file.isScene) return fail(ErrorCode::kBadInput, "a model file may not inline others");
    Expected<T> core = readTableObject<T>(message);
    if (!core) return core;
    if (core->file.empty()) return fail(ErrorCode::kBadInput, "it names no file");
    Expected<std::string> path = pathBeside(core->file, folderOf(file.path));
    if (!path) return tl::unexpected(path.error());
    core->file = std::move(*path);
    std::error_code error;
    const std::string real = std::filesystem::weakly_canonical(core->file, error).string();
    if (!error && std::ranges::find(importing, real) != importing.end()) {
        core->state = LoadWords::kFailed;
        core->problem = fmt::format("it inlines itself: {} → {}", fmt::join(importing, " → "), real);
    }
    return core;
}

}  // namespace

Expected<ObjectId> makeInline(SceneDraft& draft, const ImportedFiles& files, const LoadedFile& file,
                              const proto::scene::Node& node) {
    // What is below it is the other file's, and goes with that.
    if (node.node_size() != 0)
        return fail(ErrorCode::kBadInput, "what its file holds comes below it; put other nodes beside it");
    const auto tell = [&](const auto& core, const char* what) {
        if (!core.problem.empty()) draft.note(fmt::format("{}: {}: {}", file.label, what, core.problem));
        draft.noteNamed(file, core.file);
    };
    if (node.has_inline_()) {
        const Expected<Inline> core = readNamed<Inline>(node.inline_(), file, files.underWay());
        if (!core) return tl::unexpected(core.error());
        tell(*core, "an Inline");
        return draft.create(*core);
    }
    const Expected<ProxyGroup> core = readNamed<ProxyGroup>(node.proxy_group(), file, files.underWay());
    if (!core) return tl::unexpected(core.error());
    tell(*core, "a ProxyGroup");
    if (const Expected<void> sound = drawableOf(Object::of(*core)).check(); !sound)
        return tl::unexpected(sound.error());
    draft.countDrawable(0);  // its box is drawn
    return draft.create(*core);
}

}  // namespace tessera
