/// What lies in the folders from which an application may load, and what is on its way from there into the scene.
#pragma once

#include "common/request/EditRequests.h"

namespace tessera {

inline constexpr std::uint32_t kMostFolderEntries = 512;

/// Pages in the order of names, byte by byte.
struct FolderWish {
    std::string folder;
    std::string after;  ///< the name at which the page before has ended
    std::uint32_t pageSize = 256;

    static constexpr std::string_view kName = "FolderWish";
    static constexpr void members(auto&& take) {
        take(member<&FolderWish::folder>(1, "folder").said("empty: those that may be looked into"),
             member<&FolderWish::after>(2, "after").said("`next` of the page before; empty: the first"),
             member<&FolderWish::pageSize>(3, "page_size").between(1, kMostFolderEntries).said("entries told at most"));
    }
};

struct FolderEntry {
    std::string name;
    std::string path;  ///< as a load, or the next wish, names it
    bool isFolder = false;
    std::uint64_t bytes = 0;
    bool loads = false;  ///< its ending is one of a scene, a model or a volume

    static constexpr std::string_view kName = "FolderEntry";
    static constexpr void members(auto&& take) {
        take(member<&FolderEntry::name>(1, "name"), member<&FolderEntry::path>(2, "path").said("as a load names it"),
             member<&FolderEntry::isFolder>(3, "is_folder"), member<&FolderEntry::bytes>(4, "bytes").in("bytes"),
             member<&FolderEntry::loads>(5, "loads").said("by its ending it can be loaded"));
    }
};

/// A file on its way into the scene.
struct LoadState {
    std::uint64_t load = 0;
    std::string path;
    std::string stage;  ///< "waiting", "reading", "converting", "handing over", "building", "sending" (to
                        ///< hosts), "appearing"
    double part = -1;   ///< of that stage, 0 to 1; negative: nobody knows
    double seconds = 0;
    std::string person;  ///< whose load it is; empty: nobody's
    bool yours = false;

    static constexpr std::string_view kName = "LoadState";
    static constexpr void members(auto&& take) {
        take(member<&LoadState::load>(1, "load").said("its number, for CancelLoad"),
             member<&LoadState::path>(2, "path").said("as it was asked for"),
             member<&LoadState::stage>(3, "stage")
                 .said("waiting, reading, converting, handing over, building, sending (to hosts) or appearing"),
             member<&LoadState::part>(4, "part").said("of that stage, 0 to 1; negative: it is not known"),
             member<&LoadState::seconds>(5, "seconds").in("s").said("since it was asked for"),
             member<&LoadState::person>(6, "person").said("who asked; empty: nobody, as of an Inline or a reload"),
             member<&LoadState::yours>(7, "yours").said("asked for over this connection"));
    }
};

namespace answer {

struct Loads {
    std::vector<LoadState> loads;  ///< the oldest first

    static constexpr ToldInfo kInfo{.name = "Loads", .answer = 32, .help = "The files that are on their way"};
    static constexpr void members(auto&& take) {
        take(member<&Loads::loads>(1, "loads").atMost(&ApplicationLimits::maxPageNodes).said("the oldest first"));
    }
};

struct FolderPage {
    std::vector<FolderEntry> entries;
    std::string next;  ///< `FolderWish::after` of the next page; empty: this is the last

    static constexpr ToldInfo kInfo{.name = "FolderPage", .answer = 30, .help = "A page of what lies in a folder"};
    static constexpr void members(auto&& take) {
        take(member<&FolderPage::entries>(1, "entries").atMost(&ApplicationLimits::maxPageNodes),
             member<&FolderPage::next>(2, "next").said("where it goes on; empty: this is the last"));
    }
};

}  // namespace answer

namespace request {

/// Ordinary files and folders; nothing hidden, and no link that leads out of what may be looked into.
struct GetFiles {
    FolderWish wish;

    using Answer = answer::FolderPage;
    static constexpr RequestInfo kInfo{.number = 40,
                                       .name = "GetFiles",
                                       .role = Role::kOperator,
                                       .help = "A page of what lies in a folder from which files may be loaded",
                                       .example = R"({"folder":"/srv/models","page_size":100})"};
    static constexpr void members(auto&& take) { take(spreadMember<&GetFiles::wish>(1)); }
};

struct GetLoads {
    using Answer = answer::Loads;
    static constexpr RequestInfo kInfo{.number = 43,
                                       .name = "GetLoads",
                                       .help = "The files that are on their way into the scene, and how far each is"};
    static constexpr void members(auto&& take) { take(); }
};

/// Whoever asked for the load is told so, as of any that fails. kRefused: it appears already, and an undo takes it
/// back. kNotFound: no such load is on its way.
struct CancelLoad {
    std::uint64_t load = 0;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 44,
                                       .name = "CancelLoad",
                                       .role = Role::kEditor,
                                       .help = "Ends the load of a file that does not appear yet",
                                       .example = R"({"load":7})"};
    static constexpr void members(auto&& take) {
        take(member<&CancelLoad::load>(1, "load").said("its number among the loads"));
    }
};

using OfFiles = std::variant<GetFiles, GetLoads, CancelLoad>;

}  // namespace request

}  // namespace tessera
