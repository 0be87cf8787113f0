/// The children that read what strangers wrote, and all that each of them has.
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>

namespace tessera {

/// What one kind of child has once it is confined (Confinement.h); there is nothing that it has besides. Every child
/// computes, reads and writes the descriptors that it was given, and ends; it is one thread.
struct ConfinementProfile {
    std::string_view who;         ///< in messages: "this system cannot confine WHO"
    std::string_view otherwise;   ///< what is then not done: "the file was not read"
    std::size_t memoryBytes = 0;  ///< of address space
    unsigned openFiles = 0;       ///< descriptors, those that it was given among them
    /// Opens files for reading, of one folder and below. Without it none is opened at all: needs seccomp alone. With
    /// it: Landlock too.
    bool readsFolder = false;
    /// Has executable memory, as compilers need it.
    bool makesCode = false;
    /// May give itself more processor time, within the hard limit.
    bool extendsTime = false;
};

/// tessera-import: a model or scene, and what lies beside it.
inline constexpr ConfinementProfile kImporterProfile{.who = "the importer",
                                                     .otherwise = "the file was not read",
                                                     .memoryBytes = std::size_t{2} << 30,
                                                     .openFiles = 64,
                                                     .readsFolder = true,
                                                     .extendsTime = true};
/// tessera-decode-film: a film that is open.
inline constexpr ConfinementProfile kFilmDecoderProfile{.who = "the decoder of films",
                                                        .otherwise = "the film is not played",
                                                        .memoryBytes = std::size_t{2} << 30,
                                                        .openFiles = 16,
                                                        .extendsTime = true};
/// tessera-try-program: a person's GLSL, by Mesa's compiler, whose libraries are loaded before.
inline constexpr ConfinementProfile kProgramTrialProfile{.who = "the trial of programs",
                                                         .otherwise = "the program was not tried, and is not drawn",
                                                         .memoryBytes = std::size_t{2} << 30,
                                                         .openFiles = 64,
                                                         .makesCode = true};

/// Of one picture of a film.
inline constexpr std::chrono::seconds kTimeForPicture{20};

}  // namespace tessera
