/// What the session thread asks of the draw thread, and what it hears back. Values only.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/base/Clock.h"
#include "common/image/SharedFrame.h"
#include "common/session/ClientSession.h"

namespace tessera {

/// One attempt at a connection. Answers to the work of an earlier one come to nothing.
using Attempt = StrongId<struct AttemptTag>;

namespace work {
// What the session asks for, as it asks for it.
using Configure = client_action::Configured;  ///< not answered
using ApplySnapshot = client_action::ApplySnapshot;
using ApplyChanges = client_action::ApplyChanges;
using Draw = client_action::Draw;
/// The session thread has made the pictures of this frame, the one drawn last, those that are shown. Not answered.
struct Shown {
    FrameNumber frame;
};
using Describe = client_action::DescribeState;
/// Answered by one Image per tile, at once or when a frame that is late enough is shown.
using SendImages = client_action::SendImages;
/// Who else is on this machine; not answered.
using Meet = client_action::MeetNeighbours;
/// A neighbour may want help with its picture; not answered.
struct Help {};
/// The show is over: write what is shown. The last piece of work.
struct Finish {};
}  // namespace work

struct Work {
    Attempt attempt;
    std::variant<work::Configure, work::ApplySnapshot, work::ApplyChanges, work::Draw, work::Shown, work::Describe,
                 work::SendImages, work::Finish, work::Meet, work::Help>
        what;
};

namespace outcome {
struct Applied {
    Sequence sequence;
    StateHash stateHash;
};
struct ApplyFailed {
    std::string reason;
};
struct Drawn {
    FrameNumber frame;
    StateHash stateHash;
    ByteSlice stats;
    std::vector<ReadyFrame> pictures = {};  ///< what is to be shown, where there are files for it
};
/// The session thread's own word: it has shown what was drawn.
struct Shown {
    FrameNumber frame;
    TimePoint at;
};
struct Described {
    message::HashAnswer answer;
};
struct Image {
    message::TileImage image;
};
/// Of work that is not answered, where it is done at once.
struct Noted {};
/// A neighbour has called: from whoever waits for that, in no connection's name. Answer with Help.
struct Called {};
/// What somebody does at one of this host's windows now: from whoever listens to that, in no connection's name.
struct Input {
    InputState state;
};
/// This host cannot draw: it leaves.
struct Broken {
    Error error;
};
/// The draw thread is done. Always its last word.
struct Ended {};
}  // namespace outcome

struct Outcome {
    Attempt attempt;
    std::variant<outcome::Applied, outcome::ApplyFailed, outcome::Drawn, outcome::Shown, outcome::Described,
                 outcome::Image, outcome::Broken, outcome::Ended, outcome::Called, outcome::Input, outcome::Noted>
        what;
};

}  // namespace tessera
