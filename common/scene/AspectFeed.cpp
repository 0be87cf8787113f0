#include "common/scene/AspectFeed.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/change/LikeSizes.h"

namespace tessera {
AspectReader::~AspectReader() {
    mailbox_->close();
}

Expected<bool> AspectReader::catchUp() {
    bool any = false;
    while (const std::optional<PublishedState> next = mailbox_->tryPop()) {
        const Expected<void> applied = scene_.apply(*next->list);
        if (!applied || scene_.stateHash() != next->hash) {
            mailbox_->close();
            return fail(ErrorCode::kFailed, fmt::format("list {} does not lead to the writer's scene{}", next->number,
                                                        applied ? std::string(": was every list published?")
                                                                : ": " + applied.error().message));
        }
        number_ = next->number;
        any = true;
    }
    return any;
}

std::unique_ptr<AspectReader> AspectFeed::join(const Aspect& scene) {
    Aspect copy;
    const Expected<void> copied = copy.apply(snapshot(scene));
    TESSERA_CHECK(copied.has_value(), copied ? std::string() : copied.error().message);
    readers_.push_back({.mailbox = std::make_shared<AspectReader::Mailbox>(kQueued), .waiting = {}});
    return std::unique_ptr<AspectReader>(new AspectReader(std::move(copy), number_, readers_.back().mailbox));
}

void AspectFeed::publish(const Aspect& scene, ChangeListPtr list) {
    const bool empty = !list || list->empty();
    if (!empty) ++number_;
    std::erase_if(readers_, [](const Reader& reader) { return reader.mailbox->closed(); });
    for (Reader& reader : readers_) {
        if (!empty) {
            reader.waiting.push_back({.number = number_, .hash = scene.stateHash(), .list = list});
            mergeLikeSizes(reader.waiting, std::numeric_limits<std::size_t>::max(),
                           [](const PublishedState&, const PublishedState& newer, ChangeListPtr merged) {
                               return PublishedState{
                                   .number = newer.number, .hash = newer.hash, .list = std::move(merged)};
                           });
        }
        std::size_t taken = 0;
        while (taken < reader.waiting.size() && reader.mailbox->tryPush(reader.waiting[taken])) ++taken;
        reader.waiting.erase(reader.waiting.begin(), reader.waiting.begin() + static_cast<std::ptrdiff_t>(taken));
    }
}

std::size_t AspectFeed::waiting() const {
    std::size_t count = 0;
    for (const Reader& reader : readers_) count += reader.waiting.size();
    return count;
}

}  // namespace tessera
