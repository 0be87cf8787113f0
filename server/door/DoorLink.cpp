#include "server/door/DoorLink.h"

#include "common/request/Check.h"

namespace tessera {

std::shared_ptr<DoorLink> DoorLink::dial(ApplicationSessionOptions options, DoorWire& wire) {
    std::shared_ptr<DoorLink> link(new DoorLink);
    link->session_ = std::make_unique<ApplicationSession>(
        std::move(options), wire.transport(), [raw = link.get()](const Incoming& incoming) { raw->take(incoming); });
    wire.serve(link);
    return link;
}

DoorLink::~DoorLink() = default;

void DoorLink::ask(const ApplicationRequest& request, std::span<const Blob> arrays, Answered answered) {
    askAsItComes(request, arrays, [answered = std::move(answered)](const Expected<ByteSlice>& body) {
        answered(body ? decodeAnswer(*body) : tl::unexpected(body.error()));
    });
}

void DoorLink::askAsItComes(const ApplicationRequest& request, std::span<const Blob> arrays, AnsweredAsItCame answered,
                            const std::string& from) {
    if (over_) return answered(tl::unexpected(*over_));
    if (closed_) return answered(fail(ErrorCode::kNetwork, "the way to the wall was closed meanwhile: try again"));
    const std::shared_ptr<DoorLink> self = shared_from_this();  // a callback may let go of the last handle
    const std::uint64_t id = ++lastRequest_;
    open_.emplace(id, std::move(answered));
    forEachUpload(arrays, [&](message::Upload piece) { session_->upload(std::move(piece)); });
    session_->request(id, encodeRequest(request), from);
}

void DoorLink::close() {
    closed_ = true;
    callbacks_ = {};
    open_.clear();
}

void DoorLink::on(const LinkEvent& event) {
    const std::shared_ptr<DoorLink> self = shared_from_this();
    session_->on(event);
}

void DoorLink::advance(TimePoint now) {
    const std::shared_ptr<DoorLink> self = shared_from_this();
    session_->advance(now);
}

TimePoint DoorLink::nextDeadline() const {
    return over_ ? TimePoint::max() : session_->nextDeadline();
}

void DoorLink::take(const Incoming& incoming) {
    if (closed_) return;
    if (const auto* reply = std::get_if<incoming::Reply>(&incoming)) {
        const auto open = open_.find(reply->reply.id);
        if (open == open_.end()) return;
        const AnsweredAsItCame answered = std::move(open->second);
        open_.erase(open);
        if (!reply->reply.error.empty())
            answered(fail(reply->reply.code, reply->reply.error));
        else
            answered(reply->reply.body);
    } else if (const auto* notice = std::get_if<incoming::Notice>(&incoming)) {
        if (callbacks_.notice) callbacks_.notice(notice->notice);
    } else if (const auto* list = std::get_if<incoming::List>(&incoming)) {
        if (callbacks_.list) callbacks_.list(*list);
    } else if (const auto* configured = std::get_if<incoming::Configured>(&incoming)) {
        wall_ = configured->wall;
    } else if (const auto* ended = std::get_if<incoming::Ended>(&incoming)) {
        end(ended->over ? Error{ErrorCode::kNetwork, "the server is over"} : ended->error);
    }
}

void DoorLink::end(const Error& error) {
    if (over_) return;
    over_ = error;
    const std::map<std::uint64_t, AnsweredAsItCame> open = std::exchange(open_, {});
    for (const auto& [id, answered] : open) answered(tl::unexpected(error));
    if (callbacks_.ended) callbacks_.ended(error);
}

}  // namespace tessera
