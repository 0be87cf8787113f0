/// How much an application may say, and be told, at once.
#pragma once

#include <cstddef>

namespace tessera {

struct ApplicationLimits {
    std::size_t maxTextBytes = 4096;
    std::size_t maxBlobs = 65'536;   ///< of one proposal
    std::size_t maxIds = 8'000'000;  ///< given by one commit
    std::size_t maxContacts = 100'000;
    std::size_t maxEvents = 100'000;
    std::size_t maxDistances = 100'000;
    std::size_t maxQuestions = 4096;  ///< and ids of closed ones
    /// Of contacts, events, distances or questions in one notice or answer: what a Notice may carry at most.
    std::size_t maxCollisionBytes = std::size_t{16} << 20;
    std::size_t maxNames = 256;         ///< asked for at once
    std::size_t maxFilterCores = 4096;  ///< of one page of the tree
    std::size_t maxShared = 4096;       ///< types that one copy shares, and objects
    std::size_t maxPageNodes = 4096;
    std::size_t maxDepth = 4096;  ///< nodes from a page's top to where the next one begins
    /// Of paths and of content in one answer, each.
    std::size_t maxSceneBytes = std::size_t{64} << 20;
    std::size_t maxPieceBytes = std::size_t{256} << 10;  ///< of an array that is read in pieces
    std::size_t maxTiles = 4096;
    std::size_t maxScreens = 64;  ///< and users
    std::size_t maxHosts = 4096;
    std::size_t maxTrackers = 64;
    std::size_t maxSensors = 1024;  ///< of one tracker
    std::size_t maxPoses = 1024;    ///< heads, and wands
    std::size_t maxAxes = 64;       ///< of one wand
    std::size_t maxPeople = 1024;
    std::size_t maxNotes = 100;     ///< of one file that was loaded
    std::size_t maxVariants = 100;  ///< chosen of one file that is loaded
    std::size_t maxControls = 64;   ///< of one panel; of one of these options, and fields that it sets
    std::size_t maxNumbers = 4;     ///< of one field of these
};

}  // namespace tessera
