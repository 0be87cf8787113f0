/// Random histories of a wall's protection, beside a model that knows of each token whether it lets in.
#include <gtest/gtest.h>

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "common/access/LocalWalls.h"
#include "common/access/ServerTokens.h"
#include "common/tls/KeyFolder.h"
#include "server/door/Gatekeeper.h"
#include "server/tools/keys/KeyVerbs.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

using Hours = std::chrono::duration<double, std::ratio<3600>>;

constexpr std::uint64_t kSome = 40;  ///< histories of a test that has little time

/// Returns the seeds: TESSERA_SEED alone, or TESSERA_RUNS of them, or some.
std::vector<std::uint64_t> seeds() {
    if (const char* const one = std::getenv("TESSERA_SEED")) return {std::strtoull(one, nullptr, 10)};
    const char* const runs = std::getenv("TESSERA_RUNS");
    std::vector<std::uint64_t> all(runs ? std::strtoull(runs, nullptr, 10) : kSome);
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i + 1;
    return all;
}

constexpr std::array kRoles{Role::kViewer, Role::kEditor, Role::kOperator};
constexpr std::size_t kFolders = 2, kListens = 2, kChosenTokens = 2;

/// In memory, where there is such a place: thousands of histories write files through to their disk.
class ScratchFolder {
public:
    ScratchFolder() {
        std::string pattern =
            (::access("/dev/shm", W_OK) == 0 ? "/dev/shm/" : testing::TempDir()) + "tessera-tokens-XXXXXX";
        path_ = ::mkdtemp(pattern.data());
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string operator/(const std::string& name) const { return path_ + "/" + name; }

private:
    std::string path_;
};

/// Keys are made once: a history begins with a copy of its folders.
const ScratchFolder& madeKeys() {
    static const ScratchFolder made;
    static const bool done = [] {
        for (std::size_t i = 0; i < kFolders; ++i) {
            const KeysArguments arguments{.keys = made / std::to_string(i),
                                          .wall = TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"};
            EXPECT_TRUE(initKeys(arguments));
        }
        return true;
    }();
    EXPECT_TRUE(done);
    return made;
}

/// How the model sees a protection: tokens serve under equal ones alone.
struct ModelProtection {
    bool insecure = false;
    int folder = -1;    ///< of keys; -1: none
    int authority = 0;  ///< of the folder, counted
    int revoked = 0;    ///< so often links were revoked there, or of walls without keys
    auto operator<=>(const ModelProtection&) const = default;
};

/// A token that somebody was given, and what has to be so for it to let in.
struct HeldToken {
    enum class Kind { kOfServer, kOfPanel, kOfFolder, kChosen };
    std::string text;
    Kind kind{};
    Role role{};
    int generation = 0;  ///< of a server's tokens, or of a panel's
    int folder = -1;
    std::string name;
    double untilHour = 0;
    bool revoked = false;
};

class TokensHistory {
public:
    explicit TokensHistory(std::uint64_t seed) : random_(seed) {
        setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
        setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
        for (std::size_t i = 0; i < kFolders; ++i)
            std::filesystem::copy(madeKeys() / std::to_string(i), keys(i), std::filesystem::copy_options::recursive);
        for (std::size_t i = 0; i < kChosenTokens; ++i) {
            chosen_.push_back("the-token-that-a-person-chose-" + std::to_string(i));
            std::ofstream(chosenFile(i)) << chosen_[i] << "\n";
            held_.push_back({.text = chosen_[i], .kind = HeldToken::Kind::kChosen, .role = Role::kOperator});
        }
    }
    ~TokensHistory() {
        unsetenv("XDG_RUNTIME_DIR");
        unsetenv("XDG_STATE_HOME");
    }
    TokensHistory(const TokensHistory&) = delete;
    TokensHistory& operator=(const TokensHistory&) = delete;

    void run() {
        constexpr int kSteps = 30;
        for (int i = 0; i < kSteps && !testing::Test::HasFailure(); ++i) {
            step();
            look();
            compare();
        }
    }
    [[nodiscard]] const std::string& story() const { return story_; }
    [[nodiscard]] std::size_t letIn() const { return letIn_; }
    [[nodiscard]] std::size_t keptOut() const { return keptOut_; }

private:
    // ---- the wall

    [[nodiscard]] std::string keys(std::size_t i) const { return folder_ / ("keys-" + std::to_string(i)); }
    [[nodiscard]] std::string chosenFile(std::size_t i) const { return folder_ / ("chosen-" + std::to_string(i)); }
    [[nodiscard]] DateTime now() const {
        return began_ + std::chrono::duration_cast<std::chrono::seconds>(Hours(hour_));
    }

    void step() {
        switch (below(random_, 17)) {
            case 0:
            case 1:
            case 2:
            case 3:
                return start();
            case 4:
                return stop();
            case 5:
            case 6:
            case 7:
                return handOut();
            case 8:
            case 9:
            case 10:
                return issue();
            case 11:
                return revokeName();
            case 12:
                return revokeLinks();
            case 13:
                return renew();
            case 14:
                return beginAuthority();
            case 15:
                return restartMachine();
            default:
                story_ += "hours pass; ";
                hour_ += static_cast<double>(1 + below(random_, 6));
        }
    }

    void stop() {
        story_ += "stop; ";
        gate_.reset();
        tokens_.reset();
        context_.reset();
        running_ = -1;
    }

    /// Empties the run folder. Tokens that people chose are kept elsewhere, and so are their ends.
    void restartMachine() {
        stop();
        story_ += "the machine starts again; ";
        std::filesystem::remove_all(folder_ / "tessera");
        for (ModelPlace& place : places_) place.isEmptied = true;
    }

    void start() {
        stop();
        const int folder = static_cast<int>(below(random_, kFolders + 2)) - 2;  // -2: without keys, -1: --insecure
        const std::size_t listen = below(random_, kListens);
        const std::size_t word = below(random_, kChosenTokens + 3);
        const std::string given = word < kChosenTokens ? chosen_[word] : "";
        story_ += "start " + std::to_string(folder) + " at " + std::to_string(listen) + " " + given + "; ";
        if (folder >= 0) readKeys(folder);
        ServerTokensOptions options{.wall = "cave",
                                    .listen = "127.0.0.1:700" + std::to_string(listen),
                                    .tokenFile = given.empty() ? "" : chosenFile(word),
                                    .insecure = folder == -1,
                                    .keysFolder = folder >= 0 ? keys(static_cast<std::size_t>(folder)) : ""};
        if (folder >= 0) options.authority = [this] { return context_->authorityFingerprint(); };
        Expected<ServerTokens> made = ServerTokens::make(std::move(options), [](const std::string&) {});
        const bool expected = modelStarts(folder, listen, given);
        EXPECT_EQ(made.has_value(), expected) << (made ? "" : made.error().message);
        if (!made || !expected) return;
        tokens_.emplace(std::move(*made));
        running_ = folder;
        EXPECT_TRUE(tokens_->tell({"127.0.0.1", static_cast<std::uint16_t>(7000 + listen)}, std::nullopt));
        panel_ = freshToken();
        DoorReach reach{.open = folder == -1, .now = [this] { return now(); }};
        if (folder >= 0) reach.keys = [this] { return context_; };
        gate_.emplace(tokens_->tokens(), 7001, std::move(reach), "me", panels());
    }
    [[nodiscard]] std::vector<DoorPanel> panels() const { return {{panel_, "0123", "Hall"}}; }

    /// As KeyRing does it.
    void readKeys(int folder) {
        const Expected<TlsKeys> read = KeyFolder(keys(static_cast<std::size_t>(folder))).ofServer();
        ASSERT_TRUE(read) << read.error().message;
        const auto made = TlsContext::make(*read);
        ASSERT_TRUE(made) << made.error().message;
        context_ = *made;
    }

    /// As the server does it four times a second.
    void look() {
        if (!tokens_) return;
        if (running_ >= 0) readKeys(running_);
        const std::string before = tokens_->tokens().of(Role::kViewer);
        const Expected<bool> renewed = tokens_->look();
        ASSERT_TRUE(renewed) << renewed.error().message;
        EXPECT_EQ(*renewed, before != tokens_->tokens().of(Role::kViewer));
        if (*renewed) {
            panel_ = freshToken();
            gate_->renew(tokens_->tokens(), panels());
        }
        modelLooks();
    }

    // ---- what people do

    void handOut() {
        if (!tokens_) return;
        story_ += "link; ";
        const Expected<LocalWall> wall = onlyLocalWall();
        ASSERT_TRUE(wall) << wall.error().message;
        for (const Role role : kRoles) {
            const bool isChosen = role == Role::kOperator && !given_.empty();
            if (isChosen) {
                EXPECT_EQ(wall->tokens.of(role), given_);
                continue;
            }
            held_.push_back({.text = wall->tokens.of(role),
                             .kind = HeldToken::Kind::kOfServer,
                             .role = role,
                             .generation = role == Role::kOperator ? operators_ : generation_});
        }
        held_.push_back(
            {.text = panel_, .kind = HeldToken::Kind::kOfPanel, .role = Role::kEditor, .generation = panelGeneration_});
    }

    void issue() {
        const std::size_t folder = below(random_, kFolders);
        HeldToken token{.kind = HeldToken::Kind::kOfFolder,
                        .role = kRoles[below(random_, kRoles.size())],
                        .folder = static_cast<int>(folder),
                        .name = nameOfSomebody(),
                        .untilHour = hour_ + 0.5 + static_cast<double>(below(random_, 8))};
        story_ += "token " + std::to_string(folder) + " " + token.name + "; ";
        const Expected<std::string> said = issueToken({.keys = keys(folder),
                                                       .holders = {token.name},
                                                       .role = std::string(nameOf(token.role)),
                                                       .hours = token.untilHour});
        ASSERT_TRUE(said) << said.error().message;
        token.text = said->substr(said->rfind('\n', said->size() - 2) + 1, 43);
        held_.push_back(std::move(token));
    }

    void revokeName() {
        const std::size_t folder = below(random_, kFolders);
        const std::string name = nameOfSomebody();
        story_ += "revoke " + std::to_string(folder) + " " + name + "; ";
        bool had = false;
        for (HeldToken& token : held_) {
            if (token.folder != static_cast<int>(folder) || token.name != name || token.revoked) continue;
            had = had || hour_ < token.untilHour;
            token.revoked = true;
        }
        const Expected<std::string> said = revokeKeys({.keys = keys(folder), .holders = {name}});
        if (had) {
            EXPECT_TRUE(said) << said.error().message;
        }
    }

    void revokeLinks() {
        const int folder = static_cast<int>(below(random_, kFolders + 1)) - 1;  // -1: those without keys
        story_ += "revoke --links " + std::to_string(folder) + "; ";
        if (folder < 0) {
            ++revokedHere_;
            const Expected<std::vector<LocalWall>> ended = endLocalLinks();
            ASSERT_TRUE(ended) << ended.error().message;
            EXPECT_EQ(ended->size(), tokens_ && running_ < 0 ? 1u : 0u);
            return;
        }
        const Expected<std::string> said =
            revokeKeys({.keys = keys(static_cast<std::size_t>(folder)), .keysNamed = true, .links = true});
        ASSERT_TRUE(said) << said.error().message;
        ++revokedIn_[folder];
        endTokensOf(folder);
    }

    /// Another key of the server: tokens and links hold.
    void renew() {
        const std::size_t folder = below(random_, kFolders);
        story_ += "renew " + std::to_string(folder) + "; ";
        const Expected<std::string> said = renewKeys({.keys = keys(folder), .holders = {"server"}});
        ASSERT_TRUE(said) << said.error().message;
    }

    /// Somebody takes the authority away and begins anew.
    void beginAuthority() {
        const int folder = static_cast<int>(below(random_, kFolders));
        story_ += "init " + std::to_string(folder) + "; ";
        const std::string path = keys(static_cast<std::size_t>(folder));
        for (const char* file : {"/authority.pem", "/authority.crt"}) std::filesystem::remove(path + file);
        const Expected<std::string> said =
            initKeys({.keys = path, .wall = TESSERA_SOURCE_DIR "/deploy/walls/cave4.wall"});
        ASSERT_TRUE(said) << said.error().message;
        ++authorityOf_[folder];
        endTokensOf(folder);
    }

    std::string nameOfSomebody() { return std::array{"ada", "bob", "ci"}[below(random_, 3)]; }
    void endTokensOf(int folder) {
        for (HeldToken& token : held_) token.revoked = token.revoked || token.folder == folder;
    }

    // ---- the model

    [[nodiscard]] ModelProtection modelProtection(int folder) {
        if (folder < 0) return {.insecure = folder == -1, .revoked = revokedHere_};
        return {.folder = folder, .authority = authorityOf_[folder], .revoked = revokedIn_[folder]};
    }

    /// Tokens that a server of the wall that listened there has left.
    struct ModelPlace {
        std::optional<ModelProtection> protection;
        int generation = 0, operators = 0;
        std::set<std::string> chosen, ended;
        bool lastChosen = false;  ///< the operator's token was one that a person had chosen
        bool isEmptied = false;   ///< the server's own tokens are gone
    };

    bool modelStarts(int folder, std::size_t listen, const std::string& given) {
        const ModelProtection protection = modelProtection(folder);
        for (const ModelPlace& each : places_)
            if (each.ended.contains(given) || (each.chosen.contains(given) && each.protection != protection))
                return false;
        listen_ = listen;
        given_ = given;
        protection_ = protection;
        ModelPlace& place = places_[listen];
        if (place.protection != protection) {
            endPlace(place);
        } else if (place.isEmptied) {
            renewPlace(place);
        } else if (place.lastChosen || !given.empty()) {
            place.operators = ++generations_;
        }
        place.protection = protection;
        place.lastChosen = !given.empty();
        if (!given.empty()) place.chosen.insert(given);
        takePlace();
        panelGeneration_ = ++generations_;
        return true;
    }
    void endPlace(ModelPlace& place) {
        place.ended.merge(place.chosen);
        place.chosen.clear();
        renewPlace(place);
    }
    void renewPlace(ModelPlace& place) {
        place.lastChosen = place.isEmptied = false;
        place.generation = ++generations_;
        place.operators = ++generations_;
    }
    void takePlace() {
        generation_ = places_[listen_].generation;
        operators_ = places_[listen_].operators;
    }
    void modelLooks() {
        const ModelProtection protection = modelProtection(running_);
        if (protection == protection_) return;
        protection_ = protection;
        given_.clear();
        endPlace(places_[listen_]);
        places_[listen_].protection = protection;
        takePlace();
        panelGeneration_ = ++generations_;
    }
    [[nodiscard]] bool modelLetsIn(const HeldToken& token) const {
        switch (token.kind) {
            case HeldToken::Kind::kOfServer:
                return token.generation == (token.role == Role::kOperator ? operators_ : generation_);
            case HeldToken::Kind::kOfPanel:
                return token.generation == panelGeneration_;
            case HeldToken::Kind::kOfFolder:
                return token.folder == running_ && !token.revoked && hour_ < token.untilHour;
            case HeldToken::Kind::kChosen:
                return token.text == given_;
        }
        return false;
    }

    void compare() {
        if (!gate_) return;
        for (const HeldToken& token : held_) {
            const HttpRequest request{
                .target = "/api", .host = "127.0.0.1:7001", .authorization = "Bearer " + token.text};
            const auto who = gate_->entrantOf(request, *readTarget("/api"));
            const bool expected = modelLetsIn(token);
            ++(expected ? letIn_ : keptOut_);
            ASSERT_EQ(who.has_value(), expected) << "a token of kind " << static_cast<int>(token.kind) << ", "
                                                 << nameOf(token.role) << " " << token.name;
            ASSERT_EQ(gate_->knows(token.text), expected);
            if (!who) {
                ASSERT_EQ(who.error().status, 401);
                ASSERT_NE(who.error().body.find("has ended"), std::string::npos) << who.error().body;
                continue;
            }
            ASSERT_EQ(who->role, token.role);
            ASSERT_EQ(who->panel.empty(), token.kind != HeldToken::Kind::kOfPanel);
        }
    }

    Random random_;
    ScratchFolder folder_;
    std::vector<std::string> chosen_;
    const DateTime began_ = std::chrono::system_clock::now();
    double hour_ = 0;
    std::shared_ptr<const TlsContext> context_;
    std::optional<ServerTokens> tokens_;
    std::optional<Gatekeeper> gate_;
    std::string panel_;
    int running_ = -1;  ///< the folder of its keys; below 0: without

    std::vector<HeldToken> held_;
    std::map<int, int> revokedIn_, authorityOf_;  ///< by folder
    int revokedHere_ = 0, generations_ = 0, generation_ = 0, operators_ = 0, panelGeneration_ = 0;
    std::array<ModelPlace, kListens> places_;
    std::size_t listen_ = 0;
    std::string given_;  ///< an operator's token that a person has chosen, and which lets in
    ModelProtection protection_;
    std::string story_;
    std::size_t letIn_ = 0, keptOut_ = 0;
};

/// All: TESSERA_RUNS=10000 build/bin/unit_door --gtest_filter='TokensHunt.*'. One: TESSERA_SEED=N.
TEST(TokensHunt, ATokenLetsInAsLongAsTheModelSays) {
    std::size_t letIn = 0, keptOut = 0;
    for (const std::uint64_t seed : seeds()) {
        TokensHistory history(seed);
        history.run();
        letIn += history.letIn();
        keptOut += history.keptOut();
        ASSERT_FALSE(HasFailure()) << "TESSERA_SEED=" << seed << ": " << history.story();
    }
    EXPECT_GT(letIn, 0u);
    EXPECT_GT(keptOut, letIn) << "most have ended";
    RecordProperty("let_in", static_cast<int>(letIn));
}

}  // namespace
}  // namespace tessera
