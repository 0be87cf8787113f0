#include "server/door/Routes.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/codec/ApplicationCodec.h"
#include "common/json/ApiJson.h"
#include "common/json/RequestJson.h"
#include "common/request/Catalogue.h"
#include "common/request/Check.h"
#include "server/door/AskInJson.h"
#include "server/door/FileRoutes.h"
#include "server/door/Metrics.h"
#include "server/door/Pages.h"

namespace tessera {
namespace {

constexpr std::string_view kAskPrefix = "/api/", kTilePrefix = "/tile/", kTileEnding = ".png", kFilePrefix = "/page/";
constexpr std::string_view kAuthorityPath = "/authority.crt";  // of who knows it by its fingerprint

/// What may be done with a path; empty: there is none such.
std::string_view methodOf(std::string_view path) {
    if (path.starts_with(kAskPrefix)) return "POST";
    for (const std::string_view known :
         {"/", "/api", "/api.html", "/metrics", "/panels", "/style.css", "/socket", "/link", "/wall.jpg", "/wall.png"})
        if (path == known) return "GET";
    if (path == kAuthorityPath) return "GET";
    if (const std::string_view file = methodOfFile(path); !file.empty()) return file;
    if (path.starts_with(kFilePrefix)) return consoleFile(path.substr(kFilePrefix.size())) ? "GET" : "";
    if (path.starts_with(kTilePrefix) && path.ends_with(kTileEnding) &&
        path.size() > kTilePrefix.size() + kTileEnding.size())
        return "GET";
    return "";
}

/// Nothing of the wall is in it.
bool isForStrangers(std::string_view path) {
    return path == "/style.css" || path == kAuthorityPath || path.starts_with(kFilePrefix);
}

HttpAnswer jsonAnswer(const Json& json) {
    return {.body = jsonText(json) + "\n"};
}

int httpStatus(ErrorCode code) {
    switch (code) {
        case ErrorCode::kUsage:
        case ErrorCode::kBadInput:
            return 400;
        case ErrorCode::kNotFound:
            return 404;
        case ErrorCode::kRefused:
            return 409;
        case ErrorCode::kLimit:
            return 413;
        case ErrorCode::kNetwork:
            return 503;
        case ErrorCode::kUnsupported:
            return 501;
        case ErrorCode::kFailed:
            break;
    }
    return 500;
}

}  // namespace

HttpAnswer apiErrorAnswer(const ApiError& error) {
    return {.status = httpStatus(error.code), .body = jsonText({{"error", errorJson(error)}}) + "\n"};
}

namespace {

HttpAnswer httpAnswerOf(const ByteSlice& came) {
    const Expected<ApplicationAnswer> read = decodeAnswer(came);
    if (!read) return apiErrorAnswer({read.error().code, read.error().message});
    Binaries binaries;
    const SaidJson json = answerJson(*read, binaries);
    if (!binaries.empty()) return errorAnswer(406, "refused", "this answer brings binaries: ask it at /socket");
    return jsonAnswer({{"answer", json.name}, {"fields", json.fields}});
}

}  // namespace

std::optional<HttpAnswer> Routes::beforeBody(const HttpRequest& request) {
    const std::optional<HttpTarget> target = readTarget(request.target);
    if (!target) return errorAnswer(400, "bad_input", "no path");
    const std::string_view method = methodOf(target->path);
    knowsWho_ = wrongLogin_ = false;
    if (isForStrangers(target->path)) {
        if (std::optional<HttpAnswer> stranger = context_.gate.strangers(request)) return stranger;
    } else if (tl::expected<Entrant, HttpAnswer> who = context_.gate.entrantOf(request, *target); !who) {
        wrongLogin_ = Gatekeeper::showsWord(request, *target) && !context_.gate.strangers(request);
        if (who.error().status == 401 && target->path == "/") return tokenPage();
        return std::move(who.error());
    } else {
        who_ = *std::move(who);
        knowsWho_ = true;
    }
    if (method.empty())
        return errorAnswer(404, "not_found",
                           "there is nothing here: /api, /api.html, /metrics, /socket, /link, /wall.jpg, /wall.png, "
                           "/tile/NAME.png, /scene.tsc, /scene.tsct, /upload/NAME");
    if (request.method != method && !takesFile(target->path, request.method)) {
        HttpAnswer answer = errorAnswer(405, "refused", fmt::format("{} takes {}", target->path, method));
        answer.fields.emplace_back("Allow", method);
        return answer;
    }
    return fileRefusal(request, *target, who_, context_);
}

std::optional<HttpAnswer> Routes::tooFast() {
    const TimePoint now = std::chrono::steady_clock::now();
    if (knowsWho_ ? context_.httpRates.take(who_, now) : context_.strangersRates.take(asker_->source, now))
        return std::nullopt;
    HttpAnswer tooMany =
        errorAnswer(429, "limit", fmt::format("more than {} requests in a second", context_.limits.httpPerSecond));
    tooMany.fields.emplace_back("Retry-After", "1");
    return tooMany;
}

void Routes::answer(const HttpRequest& request, const AnswerHttp& answer) {
    if (std::optional<HttpAnswer> tooMany = tooFast()) return answer(std::move(*tooMany));
    const std::optional<HttpTarget> target = readTarget(request.target);
    if (target->path == "/") return answer(who_.panel.empty() ? consolePage() : panelPage());
    if (target->path == "/api.html") return answer(apiPage(context_.options.wall));
    if (target->path.starts_with(kFilePrefix))
        return answer(*consoleFile(std::string_view(target->path).substr(kFilePrefix.size())));
    if (target->path == "/style.css") return answer(stylePage());
    if (target->path == kAuthorityPath) {
        const CurrentKeys& keys = context_.options.reach.keys;
        const std::string pem = keys ? keys()->authorityCertificate() : std::string();
        if (pem.empty()) return answer(errorAnswer(404, "not_found", "this door has no keys, and so no authority"));
        return answer({.type = "application/x-x509-ca-cert", .body = pem});
    }
    if (target->path == "/panels") return answer(panels());
    if (target->path == "/api") {
        static const std::string kApi = jsonText(apiJson()) + "\n";
        return answer({.body = kApi});
    }
    if (target->path == "/socket" || target->path == "/link")
        return answer(errorAnswer(426, "usage", "a WebSocket is opened here"));
    if (target->path.starts_with(kAskPrefix)) return ask(target->path.substr(kAskPrefix.size()), request.body, answer);
    if (isFilePath(target->path)) return answerFile(request, *target, who_, context_, answer);
    // Pictures that others have asked for are given away here: who sees none is refused before.
    if (!who_.panel.empty())
        return answer(errorAnswer(403, "refused", "a panel's token sees no picture, and no figures"));
    DoorLink* const link = this->link(answer);
    if (!link) return;
    if (target->path == "/wall.jpg") return context_.pictures.wall(*link, answer);
    if (target->path == "/wall.png") {
        const auto& folder = context_.options.uploads;
        return context_.pictures.whole(*link, folder ? folder->path() : std::string(), answer);
    }
    if (target->path.starts_with(kTilePrefix))
        return context_.pictures.tile(
            *link,
            target->path.substr(kTilePrefix.size(), target->path.size() - kTilePrefix.size() - kTileEnding.size()),
            answer);
    link->ask(StatusQuestion{}, {}, [answer](const Expected<ApplicationAnswer>& status) {
        if (!status) return answer(apiErrorAnswer({status.error().code, status.error().message}));
        answer({.type = "application/openmetrics-text; version=1.0.0; charset=utf-8",
                .body = metricsText(std::get<answer::Status>(*status))});
    });
}

/// Who may edit may let others edit less.
HttpAnswer Routes::panels() const {
    if (who_.role < Role::kEditor || !who_.panel.empty())
        return errorAnswer(403, "refused", "words of panels are told to editors");
    Json list = Json::array();
    for (const DoorPanel& panel : context_.options.panels)
        list.push_back({{"title", panel.title}, {"token", panel.word}});
    return jsonAnswer({{"panels", std::move(list)}});
}

DoorLink* Routes::link(const AnswerHttp& answer) {
    DoorLink* const link = context_.sharedLink(who_);
    if (!link) answer(errorAnswer(503, "limit", "as many people ask at once as may: try again"));
    return link;
}

void Routes::ask(const std::string& name, const std::string& body, const AnswerHttp& answer) {
    for (const RequestText& known : allRequests()) {
        if (known.info.name != name) continue;
        if (who_.role < known.info.role)
            return answer(errorAnswer(403, "refused", roleRefusal(known.info, who_.role).message));
        if (known.info.ownLink)
            return answer(errorAnswer(406, "refused", name + " is about a connection of one's own: ask it at /socket"));
    }
    if (body.empty()) return askWith(nullptr, name, answer, asker_);
    auto read = [self = *this, name, answer](ApiExpected<Json> json, std::shared_ptr<const TextRoom> room) mutable {
        if (!json) return answer(apiErrorAnswer(json.error()));
        // Who sent a large text may be gone once it has been read.
        const void* const turn = room ? static_cast<const void*>(&self.context_) : self.asker_;
        self.askWith(keptWith(std::move(room), std::make_shared<const Json>(std::move(*json))), name, answer, turn);
    };
    if (body.size() <= kMostAtOnce) return read(parseJson(body), nullptr);
    const auto room = roomFor(body.size(), context_.brought, context_.limits.maxBroughtBytes);
    if (!room) return answer(errorAnswer(429, "limit", "too many large texts come at once"));
    const auto readIt = [body, read, room,
                         &beside = context_.beside](const std::shared_ptr<const AnswerLanes::Ticket>& ticket) {
        beside.run([body] { return parseJson(body); },
                   [read, room, ticket](ApiExpected<Json> json) mutable { read(std::move(json), room); });
    };
    context_.lanes.enter(&context_, kLargeTexts, readIt);
}

void Routes::askWith(std::shared_ptr<const Json> fields, const std::string& name, const AnswerHttp& answer,
                     const void* turn) {
    using Ticket = std::shared_ptr<const AnswerLanes::Ticket>;
    auto askNow = [self = *this, fields = std::move(fields), name, answer](const Ticket& ticket) mutable {
        DoorLink* const link = self.link(answer);
        if (!link) return;
        const auto tell = [answer, ticket](HttpAnswer made) {
            if (ticket) ticket->answered(made.body.size());
            answer(std::move(made));
        };
        askInJson(
            *link, name, std::move(fields), {},
            [tell, &beside = self.context_.beside](const ApiExpected<ByteSlice>& came) {
                if (!came) return tell(apiErrorAnswer(came.error()));
                if (came->size() <= kMostAtOnce) return tell(httpAnswerOf(*came));
                beside.run([came = *came] { return httpAnswerOf(came); }, tell);
            },
            self.who_.from);
    };
    // What changes something is not put off: it may take minutes, and its answer is small.
    const auto known = std::ranges::find(allRequests(), name, [](const RequestText& each) { return each.info.name; });
    if (known == allRequests().end() || known->info.changes != Changes::kNothing) return askNow(nullptr);
    context_.lanes.enter(turn, name, std::move(askNow));
}

}  // namespace tessera
