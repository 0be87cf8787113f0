#include "deploy/wall/Machines.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "deploy/wall/Child.h"
#include "deploy/wall/Ssh.h"

namespace tessera {

namespace {

using AskingTime = std::chrono::steady_clock::time_point;

constexpr std::size_t kMostLines = 2000;  // of one machine, before it is a machine that talks without end
constexpr std::size_t kKeptLines = 20;
constexpr std::string_view kThere = "tessera-wall: there ";
constexpr std::string_view kVersionSaid = "tessera-wall: version ";
constexpr std::string_view kCheckSaid = "tessera-wall: check ";
constexpr std::string_view kCheck = "check: ";

/// One machine that is being asked.
class Conversation {
public:
    Conversation(const MachineQuestion& question, const AskingOptions& options)
        : question_(question), options_(options), until_(std::chrono::steady_clock::now() + options.deadline) {
        answer_.host = question.host;
        answer_.destination = question.machine.ssh;
        Expected<Child> child = Child::start(
            overSsh(options.ssh, question.machine, scriptOfQuestion(question.machine, question.arguments)));
        if (!child) {
            finish({child.error().message});
            return;
        }
        child_.emplace(std::move(*child));
        child_->closeInput();
    }

    [[nodiscard]] bool done() const { return done_; }
    [[nodiscard]] MachineAnswer take() { return std::move(answer_); }
    void addHandles(std::vector<pollfd>& handles) const {
        for (const Child::Stream stream : {Child::kOut, Child::kError})
            if (!done_ && child_->handle(stream) >= 0)
                handles.push_back({.fd = child_->handle(stream), .events = POLLIN, .revents = 0});
    }

    void listen() {
        if (done_) return;
        for (const std::string& line : child_->readLines(Child::kOut)) heard(line);
        for (std::string& line : child_->readLines(Child::kError)) heardError(std::move(line));
        if (lines_ > kMostLines) return finish({talksTooMuch()});
        if (std::chrono::steady_clock::now() >= until_)
            return finish({fmt::format("it has not answered for {} s{}", options_.deadline.count() / 1000.0,
                                       there_ ? ": " + quotedLast("its client") : "")});
        const bool silent = child_->handle(Child::kOut) < 0 && child_->handle(Child::kError) < 0;
        if (std::optional<ChildEnd> end = child_->reap()) end_ = end;
        if (end_ && silent) judge();
    }

private:
    [[nodiscard]] std::string talksTooMuch() const {
        return fmt::format("`{}` talks without end there, and is no tessera-client", question_.machine.command);
    }
    [[nodiscard]] std::string quotedLast(std::string_view who) const {
        const std::string& last = !errors_.empty() ? errors_.back() : said_;
        return last.empty() ? fmt::format("{} said nothing", who) : fmt::format("{} said: {}", who, last);
    }

    void heard(const std::string& line) {
        ++lines_;
        if (line.empty()) return;
        const auto numberAfter = [&](std::string_view what) {
            int number = -1;
            std::from_chars(line.data() + what.size(), line.data() + line.size(), number);
            return number;
        };
        if (line.starts_with(kThere)) {
            there_ = true;
            answer_.seesUsAs = line.substr(kThere.size());
        } else if (!there_) {
            return;  // what the account's shell says to everybody
        } else if (line.starts_with(kVersionSaid)) {
            versionCode_ = numberAfter(kVersionSaid);
        } else if (line.starts_with(kCheckSaid)) {
            checkCode_ = numberAfter(kCheckSaid);
        } else if (!versionCode_) {
            if (version_.empty()) version_ = line.substr(0, 200);
        } else if (line.starts_with(kCheck)) {
            fact(std::string_view(line).substr(kCheck.size()));
        } else {
            said_ = line.substr(0, 400);
        }
    }
    void heardError(std::string line) {
        ++lines_;
        line.resize(std::min<std::size_t>(line.size(), 400));
        if (line.ends_with('\r')) line.pop_back();  // as ssh ends its lines
        if (!line.empty() && errors_.size() < kKeptLines) errors_.push_back(std::move(line));
    }
    void fact(std::string_view text) {
        const auto rest = [&](std::string_view word) -> std::optional<std::string> {
            return text.starts_with(word) ? std::optional(std::string(text.substr(word.size()))) : std::nullopt;
        };
        if (auto lack = rest("trouble ")) lacks_.push_back(std::move(*lack));
        if (auto pixels = rest("pixels ")) answer_.pixels = std::move(*pixels);
        if (auto cores = rest("cores ")) std::from_chars(cores->data(), cores->data() + cores->size(), answer_.cores);
    }

    /// The conversation is over: what it means.
    void judge() {
        const std::string& command = question_.machine.command;
        if (!there_) {
            if (end_->signalled || end_->value == kSshFailed || !errors_.empty())
                return finish({whySshFailed(errors_, loginByHand(question_.machine))});
            return finish({"it lets us in and runs no commands: is its shell no shell?"});
        }
        if (!checkCode_)
            return finish({fmt::format("the connection was cut while its client was asked; {}", quotedLast("it"))});
        if (versionCode_ == 127)
            return finish({fmt::format(
                "there is no `{}` (command not found): install the package there, or say in `command` where it lies",
                command)});
        if (versionCode_ == 126)
            return finish({fmt::format("`{}` cannot be run: {}", command, quotedLast("its shell"))});
        if (version_ != options_.version)
            return finish({fmt::format("`{}` is {} and not {}: both have to be of one version", command,
                                       version_.empty() ? "something that has no --version" : "\"" + version_ + "\"",
                                       options_.version)});
        if (checkCode_ != 0 && lacks_.empty())
            lacks_.push_back(fmt::format("`{} --check` fails: {}", command, quotedLast("it")));
        finish(std::move(lacks_));
    }
    void finish(std::vector<std::string> lacks) {
        answer_.lacks = std::move(lacks);
        child_.reset();
        done_ = true;
    }

    const MachineQuestion& question_;
    const AskingOptions& options_;
    AskingTime until_;
    std::optional<Child> child_;
    std::optional<ChildEnd> end_;
    MachineAnswer answer_;
    bool there_ = false, done_ = false;
    std::optional<int> versionCode_, checkCode_;
    std::string version_, said_;
    std::vector<std::string> errors_, lacks_;
    std::size_t lines_ = 0;
};

}  // namespace

std::optional<std::vector<MachineAnswer>> askMachines(const std::vector<MachineQuestion>& questions,
                                                      const AskingOptions& options, Signals& signals) {
    std::vector<std::optional<Conversation>> all(questions.size());
    std::size_t next = 0;
    for (;;) {
        std::vector<pollfd> handles{{.fd = signals.handle(), .events = POLLIN, .revents = 0}};
        std::size_t open = 0;
        for (auto& one : all) {
            if (one) one->listen();
            if (one && !one->done()) ++open;
        }
        for (; open < options.atOnce && next < all.size(); ++next, ++open) all[next].emplace(questions[next], options);
        if (std::ranges::all_of(all, [](const auto& one) { return one && one->done(); })) break;
        for (const auto& one : all)
            if (one) one->addHandles(handles);
        ::poll(handles.data(), handles.size(), 50);
        if (signals.takeStopRequest()) return std::nullopt;
    }
    std::vector<MachineAnswer> answers;
    for (auto& one : all) answers.push_back(one->take());
    return answers;
}

}  // namespace tessera
