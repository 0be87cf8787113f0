/// What each path of a door means.
#pragma once

#include "server/door/DoorContext.h"

namespace tessera {

/// Answers once, now or later; who has come in has passed the gate but for what needs no token.
class Routes {
public:
    explicit Routes(DoorContext& context) : context_(context) {}
    /// What can be said before the body is there. Nothing: read on.
    [[nodiscard]] std::optional<HttpAnswer> beforeBody(const HttpRequest& request) const;
    void answer(const HttpRequest& request, const AnswerHttp& answer);

private:
    void ask(const std::string& name, const std::string& body, const AnswerHttp& answer);

    DoorContext& context_;
};

/// Of an error of a request: its status and `{"error":…}`.
[[nodiscard]] HttpAnswer apiErrorAnswer(const ApiError& error);

}  // namespace tessera
