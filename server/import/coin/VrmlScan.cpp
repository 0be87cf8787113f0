#include "server/import/coin/VrmlScan.h"

#include <Inventor/SbName.h>
#include <Inventor/SoType.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "server/import/coin/CoinText.h"

namespace tessera {
namespace {

/// Nodes that all prototypes of a file stand for.
constexpr double kMostInstances = 500'000;
/// Coin takes three kilobytes for each, however few letters it is. Files have 20 bytes for each, and more.
constexpr std::size_t kFreeNodes = 80'000, kBytesPerNode = 16;
/// Of each Coin looks for a library.
constexpr std::size_t kMostUnknownKinds = 50'000;
/// Coin compares each with all.
constexpr std::size_t kMostProtos = 5000;
/// The text that they stand for, of which Coin makes each anew; of a larger file so many times its own.
constexpr double kMostText = 16 << 20, kMostTextFactor = 4;

/// Of VRML 2 its own kinds: Inventor has some of the same name, with other fields.
bool isKnown(std::string_view kind, Dialect dialect) {
    static std::map<std::pair<Dialect, std::string>, bool> kKinds;
    const auto [known, isNew] = kKinds.try_emplace({dialect, std::string(kind.substr(0, 200))}, false);
    if (isNew) {
        const std::string name = (dialect == Dialect::kVrml2 ? "VRML" : "") + known->first.second;
        known->second = SoType::fromName(SbName(name.c_str())) != SoType::badType();
    }
    return known->second;
}

class Scan {
public:
    Scan(std::string_view text, Dialect dialect, const MissingProto& missing)
        : text_(text), dialect_(dialect), missing_(missing) {}

    Expected<void> run() {
        while (next()) {
            if (token_ == "{" || token_ == "[") {
                if (++depth_ > kMostBrackets)
                    return problem(ErrorCode::kLimit,
                                   fmt::format("brackets are nested deeper than {} levels", kMostBrackets));
                if (token_ == "{" && ++nodes_ > kFreeNodes + text_.size() / kBytesPerNode)
                    return problem(ErrorCode::kLimit,
                                   fmt::format("it has more than {} nodes in {} bytes: save it in parts, or with small "
                                               "shapes joined",
                                               nodes_ - 1, text_.size()));
                if (token_ == "{") {
                    const std::size_t depth = depth_;
                    const std::string_view name = std::exchange(defined_, {});
                    if (Expected<void> opened = open(); !opened) return opened;
                    // One that is left out has been read over.
                    if (depth_ == depth) {
                        openNodes_.push_back({name, word_ == "Script"});
                        if (openNodes_.back().isScript) ++openScripts_;
                        if (!name.empty()) isOpen_[name] = true;
                    }
                }
                word_ = {};
            } else if (token_ == "}" || token_ == "]") {
                if (token_ == "}" && !protos_.empty() && protos_.back().depth == depth_) close();
                if (token_ == "}" && !openNodes_.empty()) {
                    const OpenNode& closed = openNodes_.back();
                    if (!closed.name.empty()) isOpen_[closed.name] = false;
                    if (closed.isScript) --openScripts_;
                    openNodes_.pop_back();
                }
                if (depth_ > 0) --depth_;
                word_ = {};
            } else if (token_.front() == '"') {
                word_ = {};
            } else {
                const bool outside = word_ == "EXTERNPROTO";
                if (dialect_ == Dialect::kVrml2 && (outside || word_ == "PROTO")) {
                    const std::string name(token_);
                    const bool there = !outside || isThere(name);
                    if (there) costs_[name] = {};
                    if (costs_.size() > kMostProtos)
                        return problem(ErrorCode::kLimit, fmt::format("it has more than {} prototypes", kMostProtos));
                    named_ = outside ? std::string_view() : token_;
                    word_ = {};
                    continue;
                }
                if (word_ == "DEF") defined_ = token_;
                // Of two nodes of a name the later one is meant. Coin goes round and round in them.
                if (const auto named = isOpen_.find(token_); word_ == "USE" && named != isOpen_.end() && named->second)
                    leaveOutUse();
                word_ = token_;
            }
        }
        return {};
    }

    /// With an empty group for each node of an unknown kind.
    [[nodiscard]] std::string mended() const {
        std::string all;
        std::size_t from = 0;
        for (const auto& [begin, end, instead] : cuts_) {
            all.append(text_, from, begin - from).append(instead);
            // Lines keep their numbers.
            all.append(static_cast<std::size_t>(std::ranges::count(text_.substr(begin, end - begin), '\n')), '\n');
            from = end;
        }
        return all.append(text_, from);
    }
    [[nodiscard]] bool isWhole() const { return cuts_.empty(); }
    [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
    [[nodiscard]] const std::map<std::string, std::size_t>& unknown() const { return unknown_; }
    [[nodiscard]] std::size_t usesInside() const { return usesInside_; }
    [[nodiscard]] const std::string& firstInside() const { return firstInside_; }

private:
    struct Cost {
        double nodes = 1, text = 0;
    };
    struct Proto {
        std::string name;
        std::size_t depth = 0;  ///< of its body's bracket
        std::size_t begin = 0;  ///< of its body
        Cost cost;
    };

    tl::unexpected<Error> problem(ErrorCode code, const std::string& what) const {
        return fail(code, fmt::format("line {}: {}", line_, what));
    }

    bool next() {
        constexpr std::string_view kEnds = " \t\r\n,{}[]\"#";
        for (; at_ < text_.size(); ++at_) {
            const char c = text_[at_];
            if (c == '\n') ++line_;
            if (c == '#') at_ = std::min(text_.find_first_of("\r\n", at_), text_.size()) - 1;
            if (c != '#' && c != ' ' && c != '\t' && c != '\r' && c != '\n' && c != ',') break;
        }
        if (at_ >= text_.size()) return false;
        const std::size_t begin = at_;
        if (text_[at_] == '"') {
            for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
                if (text_[at_] == '\n') ++line_;
                if (text_[at_] == '\\') ++at_;
            }
            at_ = std::min(at_ + 1, text_.size());
        } else if (kEnds.find(text_[at_]) != kEnds.npos) {
            ++at_;
        } else {
            at_ = std::min(text_.find_first_of(kEnds, at_), text_.size());
        }
        token_ = text_.substr(begin, at_ - begin);
        return true;
    }

    /// At a bracket that begins a node, or the body of a prototype.
    Expected<void> open() {
        if (dialect_ == Dialect::kX3d) return {};
        if (dialect_ == Dialect::kInventor) {
            // What it does not know may say its fields, and Coin reads over it.
            if (!word_.empty() && !isKnown(word_, dialect_) &&
                !text_.substr(std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size())).starts_with("fields"))
                return leaveOut(std::string(word_));
            return {};
        }
        if (word_.empty()) {
            if (!named_.empty()) protos_.push_back({std::string(named_), depth_, at_, {}});
            named_ = {};
            return {};
        }
        const std::string kind(word_);
        for (const Proto& proto : protos_)
            if (proto.name == kind)
                return problem(ErrorCode::kBadInput, fmt::format("PROTO '{}' contains itself", kind.substr(0, 80)));
        Cost cost;
        if (const auto known = costs_.find(kind); known != costs_.end()) {
            cost = known->second;
        } else if (!isKnown(kind, dialect_)) {
            if (Expected<void> done = leaveOut(kind); !done) return done;
        }
        Cost& sum = protos_.empty() ? cost_ : protos_.back().cost;
        sum.nodes += cost.nodes;
        sum.text += cost.text;
        if (sum.text > std::max(kMostText, kMostTextFactor * static_cast<double>(text_.size())))
            return problem(ErrorCode::kLimit, fmt::format("its prototypes stand for more than {:.0f} MiB of text",
                                                          std::floor(sum.text / (1 << 20))));
        if (sum.nodes > kMostInstances && cost.nodes > 1)
            return problem(ErrorCode::kLimit,
                           fmt::format("its prototypes stand for more than {} nodes", kMostInstances));
        return {};
    }

    /// Behind the name of an EXTERNPROTO: its interface and its files. One that is not there is cut out.
    bool isThere(const std::string& name) {
        const auto begin = static_cast<std::size_t>(word_.data() - text_.data());
        if (!next() || token_ != "[") return true;  // Coin says what is wrong
        for (std::size_t inside = 1; inside > 0 && next();) {
            if (token_ == "[") ++inside;
            if (token_ == "]") --inside;
        }
        std::vector<std::string> urls;
        const auto take = [&] {
            if (token_.size() >= 2 && token_.front() == '"') urls.emplace_back(token_.substr(1, token_.size() - 2));
        };
        if (!next()) return true;
        take();
        if (token_ == "[")
            while (next() && token_ != "]") take();
        const std::string why = missing_(urls);
        if (why.empty()) return true;
        problems_.push_back(fmt::format("the EXTERNPROTO '{}' is not there: {}", name.substr(0, 80), why));
        cuts_.push_back({begin, at_, ""});
        return false;
    }

    void close() {
        Cost& cost = costs_[protos_.back().name] = protos_.back().cost;
        cost.text += static_cast<double>(at_ - protos_.back().begin);
        protos_.pop_back();
    }

    /// To its closing bracket.
    Expected<void> leaveOut(const std::string& kind) {
        const auto begin = static_cast<std::size_t>(word_.data() - text_.data());
        ++unknown_[kind.substr(0, 80)];
        if (unknown_.size() > kMostUnknownKinds)
            return problem(ErrorCode::kLimit, fmt::format("it has more than {} kinds of nodes that are not known: save "
                                                          "it without them, or as VRML 2",
                                                          kMostUnknownKinds));
        std::size_t inside = 1;
        while (inside > 0 && next()) {
            if (token_ == "{") ++inside;
            if (token_ == "}") --inside;
        }
        --depth_;
        cuts_.push_back({begin, at_, "Group {}"});
        return {};
    }

    void leaveOutUse() {
        if (dialect_ == Dialect::kX3d) return;
        // A Script may well know the node around it, and is left out itself, with a note.
        if (openScripts_ == 0 && usesInside_++ == 0) firstInside_ = token_.substr(0, 80);
        cuts_.push_back({static_cast<std::size_t>(word_.data() - text_.data()), at_, "Group {}"});
    }

    std::string_view text_, token_, word_, named_, defined_;
    Dialect dialect_;
    const MissingProto& missing_;
    std::size_t at_ = 0, line_ = 1, depth_ = 0, nodes_ = 0;
    std::vector<Proto> protos_;  ///< whose bodies are open
    std::map<std::string, Cost> costs_;
    Cost cost_;
    struct Cut {
        std::size_t begin, end;
        const char* instead;
    };
    std::vector<Cut> cuts_;
    std::vector<std::string> problems_;
    std::map<std::string, std::size_t> unknown_;
    struct OpenNode {
        std::string_view name;  ///< or nothing
        bool isScript = false;
    };
    std::vector<OpenNode> openNodes_;  ///< whose brackets are open
    std::unordered_map<std::string_view, bool> isOpen_;
    std::size_t usesInside_ = 0, openScripts_ = 0;
    std::string firstInside_;
};

}  // namespace

Expected<void> scanVrml(std::string& text, Dialect dialect, const MissingProto& missing,
                        std::vector<std::string>& notes) {
    Scan scan(text, dialect, missing);
    if (Expected<void> done = scan.run(); !done) return done;
    if (scan.isWhole()) return {};
    constexpr std::size_t kMostLines = 10;
    std::size_t line = 0;
    notes.insert(notes.end(), scan.problems().begin(),
                 scan.problems().begin() + static_cast<std::ptrdiff_t>(std::min(scan.problems().size(), kMostLines)));
    for (const auto& [kind, count] : scan.unknown()) {
        if (++line > kMostLines) {
            notes.push_back(
                fmt::format("{} more unknown kinds of nodes are left out", scan.unknown().size() - kMostLines));
            break;
        }
        notes.push_back(fmt::format("left out: {}, an unknown kind of node{}", kind,
                                    count > 1 ? fmt::format(", {} times", count) : ""));
    }
    if (const std::size_t uses = scan.usesInside(); uses > 0)
        notes.push_back(fmt::format("left out: uses of a node inside itself{} (the first: '{}')",
                                    uses > 1 ? fmt::format(", {} times", uses) : "", scan.firstInside()));
    text = scan.mended();
    return {};
}

}  // namespace tessera
