/// What applications ask for, from the question to the answer.
#pragma once

#include <span>
#include <vector>

#include "server/sim/desk/Desk.h"

namespace tessera {

/// The door of the desk: what comes goes to the room that it concerns. Every request is answered exactly once, unless
/// its application has gone. Nobody who is told of collisions, or asked about them, is waited for. Frame thread only.
class RequestDesk {
public:
    using Limits = DeskLimits;
    using Surroundings = DeskSurroundings;
    static constexpr std::uint64_t kStartScene = OpenEdits::kStartScene;

    explicit RequestDesk(const Surroundings& around, const Limits& limits = {}) : desk_(around, limits) {}

    /// All return what the session wants done.
    [[nodiscard]] ServerActions received(const server_action::RequestReceived& request, TimePoint now);
    [[nodiscard]] ServerActions blobsEverywhere(std::uint64_t token);
    /// Arrays of an application's next proposal. Costs the same however large they are.
    void uploading(const server_action::UploadReceived& received);
    [[nodiscard]] ServerActions uploaded(UploadFinished finished, TimePoint now) {
        return desk_.proposals.uploaded(std::move(finished), now);
    }
    [[nodiscard]] ServerActions prepared(Preparation made, TimePoint now) {
        if (made.copy) return desk_.copies.copied(std::move(made), now);
        return made.file ? desk_.reloads.read(std::move(made), now) : desk_.loads.loaded(std::move(made), now);
    }
    /// Of the scene before the first frame.
    void remember(FileInScene file) { desk_.reloads.remember(std::move(file)); }
    /// Of one that goes on from a journal.
    void findAgain(const std::vector<std::string>& files, const Placing& placing, const std::string& begunWith) {
        desk_.reloads.findAgain(files, placing, begunWith);
    }
    void loadContent(Preparation order) { desk_.loads.loadContent(std::move(order)); }
    [[nodiscard]] ServerActions imageReceived(const server_action::ImageReceived& image, TimePoint now) {
        return PreviewRequests::isOurs(image.image.request) ? desk_.previews.imageReceived(image, now)
                                                            : desk_.images.imageReceived(image);
    }
    /// What was ordered by `orderSurvey`.
    [[nodiscard]] ServerActions surveyed(const AnimatedBounds& bounds, Sequence at) {
        return desk_.views.surveyed(bounds, at);
    }
    [[nodiscard]] ServerActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    /// `from`: the other end of its link. `panel`: the text of the one whose fields it reaches alone; null: none.
    void applicationJoined(ConnectionId connection, Desk::Known known = {}, const std::string& from = {},
                           const std::string* panel = nullptr);
    void applicationLeft(ConnectionId connection);

    /// The edits for the frame that is about to be made.
    [[nodiscard]] std::vector<Edit> takeEdits();
    /// And the answers to questions for it.
    [[nodiscard]] std::vector<Reply> takeReplies() { return desk_.news.takeReplies(); }
    /// `openQuestions`: ids of those that stand after this frame.
    [[nodiscard]] ServerActions committed(FrameResult frame, FrameNumber number,
                                          std::span<const std::uint64_t> openQuestions);
    /// Heads and wands of the frame that was made.
    [[nodiscard]] ServerActions heads(const notice::Poses& poses) { return desk_.news.poses(poses); }
    void frameDrawn(const server_action::FrameStats& said, const HostStats& stats, TimePoint now) {
        desk_.news.drawn(said.host, said.frame, stats, now);
    }
    void frameShown(const server_action::FrameShown& shown) { desk_.news.seen(shown); }
    [[nodiscard]] ServerActions frameReleased(const server_action::FrameReleased& release, TimePoint now) {
        return desk_.news.released(release, now);
    }

private:
    Desk desk_;
};

}  // namespace tessera
