/// What each path of a door means.
#pragma once

#include "common/json/Json.h"
#include "server/door/DoorContext.h"

namespace tessera {

/// Answers once, now or later; who has come in has passed the gate but for what needs no token.
class Routes {
public:
    /// `asker`: it is there whenever a request comes, and takes turns among those who ask for much (AnswerLanes).
    Routes(DoorContext& context, const Guest& asker) : context_(context), asker_(&asker) {}
    /// What can be said before the body is there. Nothing: read on.
    [[nodiscard]] std::optional<HttpAnswer> beforeBody(const HttpRequest& request);
    void answer(const HttpRequest& request, const AnswerHttp& answer);
    /// Nothing: this one may be asked now; it counts.
    [[nodiscard]] std::optional<HttpAnswer> tooFast();
    /// Of who has come in, once beforeBody has said nothing.
    [[nodiscard]] const Entrant& who() const { return who_; }
    /// A token was shown.
    [[nodiscard]] bool knowsWho() const { return knowsWho_; }
    /// A token was shown, and lets nobody in.
    [[nodiscard]] bool wrongLogin() const { return wrongLogin_; }

private:
    [[nodiscard]] HttpAnswer panels() const;
    void ask(const std::string& name, const std::string& body, const AnswerHttp& answer);
    /// Null: it has answered that too many ask at once.
    [[nodiscard]] DoorLink* link(const AnswerHttp& answer);
    /// `turn`: whose it is among those who ask for much (AnswerLanes).
    void askWith(std::shared_ptr<const Json> fields, const std::string& name, const AnswerHttp& answer,
                 const void* turn);

    DoorContext& context_;
    const Guest* asker_;
    Entrant who_;
    bool knowsWho_ = false, wrongLogin_ = false;
};

/// Of an error of a request: its status and `{"error":…}`.
[[nodiscard]] HttpAnswer apiErrorAnswer(const ApiError& error);

}  // namespace tessera
