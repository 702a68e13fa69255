#pragma once

#include <cmath>
#include <cstddef>

/// Bounds of evidence: how many nats, how small a false-alarm rate or how large an effect a statement needs. Each has
/// its unit, its meaning and a reference to the run that set it, a section of
/// docs/verification/calibration_of_bounds.md. Bounds that follow from the user's stated accuracies are derived from
/// them in stated_bounds.h. Constants of numerics and of effort (steps, starts, grids) stay where they are used.
namespace mmradartwin::diagnosis::bounds {

// ---- frames

/// Chance that frames of a clean session give a finding of one kind; see
/// docs/verification/calibration_of_bounds.md#kframesfalsealarmrate
inline constexpr double kFramesFalseAlarmRate = 1e-6;
/// Nats by which a run of zeros is a lost packet; see
/// docs/verification/calibration_of_bounds.md#kleastnatsofzeroedpacket
inline const double kLeastNatsOfZeroedPacket = std::log(1e6) + std::log(1e6);
/// Share of a frame's power, by which frames have to differ where packets slipped; see
/// docs/verification/calibration_of_bounds.md#kleastslipshare
inline constexpr double kLeastSlipShare = 0.1;
/// Multiple of the usual change between frames, from which on a frame jumps; see
/// docs/verification/calibration_of_bounds.md#kleastslipoverusual
inline constexpr double kLeastSlipOverUsual = 4.0;
/// Share of the misfit beyond noise, that a slip may leave unexplained; see
/// docs/verification/calibration_of_bounds.md#kmostleftofslip
inline constexpr double kMostLeftOfSlip = 0.2;
/// Number of codes a signal has to span before its outermost code says anything; see
/// docs/verification/calibration_of_bounds.md#kleastcodes
inline constexpr int kLeastCodes = 256;
/// Odds by which samples that pile up at the last code of 16 bits are likelier clipped; see
/// docs/verification/calibration_of_bounds.md#koddsoflastcode
inline constexpr double kOddsOfLastCode = 1e3;
/// Chance that noise in one window of samples passes for a burst; see
/// docs/verification/calibration_of_bounds.md#kburstwindowfalsealarmrate
inline constexpr double kBurstWindowFalseAlarmRate = 1e-12;
/// Chance of a burst in a clean session; see docs/verification/calibration_of_bounds.md#kburstsfalsealarmrate
inline constexpr double kBurstsFalseAlarmRate = 1e-5;
/// Multiple of the noise, from which on a whole chirp differs from the average; see
/// docs/verification/calibration_of_bounds.md#kleastnoiseofmover
inline constexpr double kLeastNoiseOfMover = 1.5;
/// Multiple of a mover's own level, from which on a window is no beat of several movers; see
/// docs/verification/calibration_of_bounds.md#kleastburstovermover
inline constexpr double kLeastBurstOverMover = 16.0;
/// Share of a chirp's power in two groups of range bins, from which on it is echoes; see
/// docs/verification/calibration_of_bounds.md#kleastshareofmovers
inline constexpr double kLeastShareOfMovers = 0.8;
/// Share of a burst's power beyond noise, that one direction holds; see
/// docs/verification/calibration_of_bounds.md#kleastshareofonewave
inline constexpr double kLeastShareOfOneWave = 0.7;
/// Share of a burst's power at one receiver, beyond which it is that receiver's fault; see
/// docs/verification/calibration_of_bounds.md#kmostshareofonereceiver
inline constexpr double kMostShareOfOneReceiver = 0.9;
/// Share of the standing echoes, from which on the radar itself changes; see
/// docs/verification/calibration_of_bounds.md#kleastunsteadyshare
inline constexpr double kLeastUnsteadyShare = 0.5;
/// Number of poses at which the radar has to change before it is said; see
/// docs/verification/calibration_of_bounds.md#kfewestunsteadyposes
inline constexpr std::size_t kFewestUnsteadyPoses = 3;
/// Difference between the lowest and the highest common level of frames, from which on it is told, dB; see
/// docs/verification/calibration_of_bounds.md#kleastframegain_db
inline constexpr double kLeastFrameGain_db = 0.1;
/// Standard deviations of chi-squared by which frames' levels differ beyond their errors; see
/// docs/verification/calibration_of_bounds.md#kleastframegain_deviations
inline constexpr double kLeastFrameGain_deviations = 12.0;
/// Multiple of the noise, from which on a range bin holds a standing echo; see
/// docs/verification/calibration_of_bounds.md#kleaststandingovernoise
inline constexpr double kLeastStandingOverNoise = 30.0;
/// Multiple of the noise, from which on a standing echo varies; see
/// docs/verification/calibration_of_bounds.md#kleastvariedovernoise
inline constexpr double kLeastVariedOverNoise = 4.0;
/// Share of a standing echo's power, from which on it varies; see
/// docs/verification/calibration_of_bounds.md#kleastvariedshare
inline constexpr double kLeastVariedShare = 0.1;
/// Standard deviations of a range bin's scatter, from which on something moves in it; see
/// docs/verification/calibration_of_bounds.md#kleastbinscatter_deviations
inline constexpr double kLeastBinScatter_deviations = 6.0;
/// Chance that noise in one range bin of a frame passes for a moving echo; see
/// docs/verification/calibration_of_bounds.md#kmovingbinfalsealarmrate
inline constexpr double kMovingBinFalseAlarmRate = 1e-6;
/// Chance that noise in one cell of range and Doppler passes for a moving echo; see
/// docs/verification/calibration_of_bounds.md#kdopplercellfalsealarmrate
inline constexpr double kDopplerCellFalseAlarmRate = 1e-9;
/// Chance of a mover with Doppler in a clean frame; see
/// docs/verification/calibration_of_bounds.md#kdopplerfalsealarmrate
inline constexpr double kDopplerFalseAlarmRate = 1e-5;
/// Share of a moving cell's power in one beam, from which on it is one echo; see
/// docs/verification/calibration_of_bounds.md#kleastshareofonebeam
inline constexpr double kLeastShareOfOneBeam = 0.5;
/// Share of a nearer mover's power, below which a mover may be its echo by way of a wall; see
/// docs/verification/calibration_of_bounds.md#kmostghostshare
inline constexpr double kMostGhostShare = 0.01;
/// Share of a frame's strongest moving cell, from which on a cell's channels are told; see
/// docs/verification/calibration_of_bounds.md#kleastshareofstrongestcell
inline constexpr double kLeastShareOfStrongestCell = 0.03;
/// Nats by which a pose carries what moves; see docs/verification/calibration_of_bounds.md#kleastnatsatpose
inline constexpr float kLeastNatsAtPose = 10.0f;
/// Nats of one pose beyond which more evidence convinces no more; see
/// docs/verification/calibration_of_bounds.md#kconvincingnatsatpose
inline constexpr float kConvincingNatsAtPose = 50.0f;
/// Share of the evidence of cells that counts; see docs/verification/calibration_of_bounds.md#ktrustinmotion
inline constexpr double kTrustInMotion = 0.8;
/// Share of a walker's speed that all poses err by together, a standard deviation; see
/// docs/verification/calibration_of_bounds.md#kwalkspeederror
inline constexpr double kWalkSpeedError = 0.07;

// ---- channels

/// Share of a frame's power, by which it differs while the radar still moves; see
/// docs/verification/calibration_of_bounds.md#kleastchangeofmovingframe
inline constexpr double kLeastChangeOfMovingFrame = 1e-4;
/// Multiple of the usual change between frames, from which on the radar still moves; see
/// docs/verification/calibration_of_bounds.md#kleastmovingoverusual
inline constexpr double kLeastMovingOverUsual = 4.0;
/// Number of motions that a lag of poses is read from; see docs/verification/calibration_of_bounds.md#kfewestmotions
inline constexpr std::size_t kFewestMotions = 3;
/// Way between two stops from which on a motion counts, metres; see
/// docs/verification/calibration_of_bounds.md#kleastmotion_m
inline constexpr double kLeastMotion_m = 0.05;
/// Share of frames' power, by which frames change more on the way than at rest; see
/// docs/verification/calibration_of_bounds.md#kleastchangeontheway
inline constexpr double kLeastChangeOnTheWay = 0.1;
/// Least lag of poses that is told, seconds; see docs/verification/calibration_of_bounds.md#kleastlag_s
inline constexpr double kLeastLag_s = 0.02;
/// Chance that a session without a lag is said to have one; see
/// docs/verification/calibration_of_bounds.md#klagfalsealarmrate
inline constexpr double kLagFalseAlarmRate = 0.01;

// ---- likelihood

// ---- hypotheses
/// Gain over its overdispersion from which on a law of all echoes stands though no map gains by it; see
/// docs/verification/calibration_of_bounds.md#least-nats-by-kind, and so the bounds that follow
inline constexpr double kLeastNatsOfGlobal = 18;
/// The same of a law that moves echoes in the room: the likelihood is rough there.
inline constexpr double kLeastNatsOfTracing = 40;
/// The same of a law that adds echoes (edges, ways over floor and ceiling), at all and for each pose.
inline constexpr double kLeastNatsOfAddition = 25, kLeastNatsOfAdditionPerPose = 4;
/// The same for each pose where the addition has the size that theory gives it, and the share of that size from which
/// on it has.
inline constexpr double kLeastNatsOfTypicalAdditionPerPose = 2, kTypicalShare = 0.75;
/// The same of something about one actor or material, and of a law without a name.
inline constexpr double kLeastNatsOfSubject = 24;
/// The same of something that adds echoes of one actor or material.
inline constexpr double kLeastNatsOfAdditionOfSubject = 45;
/// The same of one actor's law without a name, at all and for each pose.
inline constexpr double kLeastNatsOfActorLaw = 16, kLeastNatsOfActorLawPerPose = 0.6;
/// The same of an object: it has the whole room to choose from.
inline constexpr double kLeastNatsOfPlacedObject = 70;
/// The same for each pose: the errors of a twin add up over poses.
inline constexpr double kLeastNatsOfGlobalPerPose = 0.4, kLeastNatsOfSubjectPerPose = 1;
/// Overdispersion of the scores of levels in sessions without a hidden effect, and the number of places whose scatter
/// that knowledge is worth; see docs/verification/calibration_of_bounds.md#kusualoverdispersionoflevels
inline constexpr double kUsualOverdispersionOfLevels = 1.4, kPlacesOfUsualOverdispersion = 12;

// ---- fit
/// Gain by which other latents of a state have to be better to replace its own; see
/// docs/verification/calibration_of_bounds.md#kleastnatsofbetterlatents
inline constexpr double kLeastNatsOfBetterLatents = 0.5;
/// Distance of two sets of latents below which both climb to one optimum; see
/// docs/verification/calibration_of_bounds.md#ksameoptimum_nats
inline constexpr double kSameOptimum_nats = 1;
/// Gain, the best place left out, from which on a finding is overwhelming, whatever its scatter over places; see
/// docs/verification/calibration_of_bounds.md#koverwhelming_nats_per_pose
inline constexpr double kOverwhelming_nats_per_pose = 5;
/// Upper limit of the false-alarm rate of an overwhelming finding; see
/// docs/verification/calibration_of_bounds.md#kfalsealarmrateofoverwhelming
inline constexpr double kFalseAlarmRateOfOverwhelming = 0.01;
/// Gain over its overdispersion from which on a move far away is believed; see
/// docs/verification/calibration_of_bounds.md#kleastnatsoffaraway
inline constexpr double kLeastNatsOfFarAway = 60;
/// Price of each fitted or searched number when hypotheses are ranked; see
/// docs/verification/calibration_of_bounds.md#kpriceofnumber_nats
inline constexpr double kPriceOfNumber_nats = 5;
/// Further price of an object that the twin lacks: it is the best of many places; see
/// docs/verification/calibration_of_bounds.md#kpriceofplace_nats
inline constexpr double kPriceOfPlace_nats = 10;
/// Share of its gain by which a law without a name is ranked beside names; see
/// docs/verification/calibration_of_bounds.md#krankedshareoflaw
inline constexpr double kRankedShareOfLaw = 2.0 / 3;
/// Share of their gain by which several searched steps of the gain are ranked; see
/// docs/verification/calibration_of_bounds.md#krankedshareofsteps
inline constexpr double kRankedShareOfSteps = 0.9;
/// Share of its gain by which a law of channels or directions is ranked; see
/// docs/verification/calibration_of_bounds.md#krankedshareofnestinglaw
inline constexpr double kRankedShareOfNestingLaw = 0.9;

// ---- receiver

/// Chance of a body-fixed tone in a session without one; see
/// docs/verification/calibration_of_bounds.md#ktonefalsealarmrate
inline constexpr double kToneFalseAlarmRate = 1e-6;
/// Nats by which a body-fixed tone is beyond doubt; see docs/verification/calibration_of_bounds.md#kleastnatsoftone
inline constexpr double kLeastNatsOfTone = 30.0;
/// Standard error that skirts of echoes add to a tone's range, metres; see
/// docs/verification/calibration_of_bounds.md#ktonerangeerror_m
inline constexpr double kToneRangeError_m = 0.00025;
/// Share of an echo's power that errors of channels take out of its array response; see
/// docs/verification/calibration_of_bounds.md#kechoerrorshare
inline constexpr double kEchoErrorShare = 0.03;
/// Share of the first range bins' power that a tone at the only pose holds; see
/// docs/verification/calibration_of_bounds.md#kleasttoneshare
inline constexpr double kLeastToneShare = 0.5;
/// Multiple of the noise that a tone at the only pose exceeds; see
/// docs/verification/calibration_of_bounds.md#kleasttoneovernoise
inline constexpr double kLeastToneOverNoise = 100.0;
/// Share of the strongest bin's power that a tone at the only pose exceeds; see
/// docs/verification/calibration_of_bounds.md#kleasttoneofstrongest
inline constexpr double kLeastToneOfStrongest = 0.01;
/// Nats by which a tone behind the radar says that samples are conjugated; see
/// docs/verification/calibration_of_bounds.md#kleastnatsbehind
inline constexpr double kLeastNatsBehind = 12.0;
/// Multiple of the noise, of an echo that tells errors of channels; see
/// docs/verification/calibration_of_bounds.md#kleastechoovernoise
inline constexpr double kLeastEchoOverNoise = 100.0;
/// Number of echoes that tell errors of channels; see docs/verification/calibration_of_bounds.md#kfewestechoes
inline constexpr std::size_t kFewestEchoes = 6;
/// Number of groups of echoes that tell errors of channels; see
/// docs/verification/calibration_of_bounds.md#kfewestechogroups
inline constexpr std::size_t kFewestEchoGroups = 3;
/// Nats by which channels have errors; see docs/verification/calibration_of_bounds.md#kleastnatsofchannelerrors
inline constexpr double kLeastNatsOfChannelErrors = 25.0;
/// Nats by which errors of channels predict echoes that the fit did not see; see
/// docs/verification/calibration_of_bounds.md#kleastheldoutnatsofchannelerrors
inline constexpr double kLeastHeldOutNatsOfChannelErrors = 8.0;
/// Nats by which channels stand in another order; see
/// docs/verification/calibration_of_bounds.md#kleastnatsofchannelorder
inline constexpr double kLeastNatsOfChannelOrder = 20.0;
/// Difference of nats within which two orders of channels fit alike; see
/// docs/verification/calibration_of_bounds.md#ksameorder_nats
inline constexpr double kSameOrder_nats = 1.0;
/// Nats by which samples were delivered in another way; see
/// docs/verification/calibration_of_bounds.md#kleastconventionnatsperpose
inline constexpr double kLeastConventionNatsPerPose = 2.0;
/// Number of conventions tried, which a false alarm counts; see
/// docs/verification/calibration_of_bounds.md#kconventiontries
inline constexpr double kConventionTries = 50.0;
/// Widths of a 95 % interval within which a finding says what the twin states; see
/// docs/verification/calibration_of_bounds.md#ksamevalue_intervals
inline constexpr double kSameValue_intervals = 1.0;
/// Distance within which a walker is the one that the twin states, metres; see
/// docs/verification/calibration_of_bounds.md#ksamewalker_m
inline constexpr double kSameWalker_m = 0.5;
/// Range up to which a tone is a constant offset, metres; see
/// docs/verification/calibration_of_bounds.md#kmostconstantrange_m
inline constexpr double kMostConstantRange_m = 0.01;
/// Multiple of the power beside its image, of a cell whose image is read; see
/// docs/verification/calibration_of_bounds.md#kleasthostoverimage
inline constexpr double kLeastHostOverImage = 10.0;
/// Delay of a transmitter's channels below which, or within so many standard errors of which, it is no more than a
/// phase: ways to two transmitters at 8 mm from each other differ by as much.
inline constexpr double kLeastDelay_m = 0.003, kLeastDelay_sigmas = 5;
/// Probability by chance below which receivers' images differ: one in a hundred images is told receiver by receiver
/// without need.
inline constexpr double kReceiversDiffer = 0.01;
/// Estimated over stated error of the ground from which on the session is judged by the estimate; see
/// docs/verification/calibration_of_bounds.md#errors-of-the-ground
inline constexpr double kFarWorse = 1.5;
/// Share of the stated error of levels below which no estimate is believed; see
/// docs/verification/calibration_of_bounds.md#errors-of-the-ground
inline constexpr double kLeastShareOfStated = 0.2;
/// Least standard error of an image's level, dB; see docs/verification/calibration_of_bounds.md#kimageerror_db
inline constexpr double kImageError_db = 0.03;
/// Difference between the noise and what the twin states, from which on it is told, dB; see
/// docs/verification/calibration_of_bounds.md#kleastnoisechange_db
inline constexpr double kLeastNoiseChange_db = 0.3;
/// Standard errors of the noise, from which on it differs from what the twin states; see
/// docs/verification/calibration_of_bounds.md#kleastnoisechange_errors
inline constexpr double kLeastNoiseChange_errors = 6.0;
/// Least standard error of the noise's level, dB; see docs/verification/calibration_of_bounds.md#knoiseerror_db
inline constexpr double kNoiseError_db = 0.02;

// ---- search
/// Promise from which on a law without a name, or a replica of echoes, is worth a fit; see
/// docs/verification/calibration_of_bounds.md#kleastnatsoflaw
inline constexpr double kLeastNatsOfLaw = 8;
/// Promise of the best of all places from which on an object there is taken for real; see
/// docs/verification/calibration_of_bounds.md#kleastnatsofobject
inline constexpr double kLeastNatsOfObject = 3;
/// Promise from which on a second face of an actor is worth a fit; see
/// docs/verification/calibration_of_bounds.md#kleastnatsofsecondface
inline constexpr double kLeastNatsOfSecondFace = 50;
/// Nats of an actor's own errors from which on the actor is looked for elsewhere; see
/// docs/verification/calibration_of_bounds.md#kleastnatsoutofplace
inline constexpr double kLeastNatsOutOfPlace = 1.2;
/// Gain by all of an actor's echoes nearer or farther away from which on the actor is looked for elsewhere; see
/// docs/verification/calibration_of_bounds.md#kleastnatselsewhere
inline constexpr double kLeastNatsElsewhere = 5;
/// Standard deviations from none at which an error that latents share is tried as a cause; see
/// docs/verification/calibration_of_bounds.md#ksharedlatent_sigmas
inline constexpr double kSharedLatent_sigmas = 3;
/// Price of each number of a law when laws are compared; see
/// docs/verification/calibration_of_bounds.md#kpriceoflawnumber_nats
inline constexpr double kPriceOfLawNumber_nats = 4;
/// Nats over the price that a law has at least; a fit sometimes finds what paths alone show less of; see
/// docs/verification/calibration_of_bounds.md#kleastnetnatsoflaw
inline constexpr double kLeastNetNatsOfLaw = -2;
/// Effective number of places that tell of a law with nothing outside a part of its variable, at least; see
/// docs/verification/calibration_of_bounds.md#kfewestplacesoflaw
inline constexpr double kFewestPlacesOfLaw = 3;
/// Factor of the nats that time explains beyond which gains that differ from pose to pose follow no time; see
/// docs/verification/calibration_of_bounds.md#kbeyondtime
inline constexpr double kBeyondTime = 1.5;

// ---- gain

// ---- rounds
/// False-alarm rate of the best hypothesis of a round up to which it may be a finding, family-wise.
inline constexpr double kFalseAlarmRateOfRound = 0.01;
/// Difference of ranking over the overdispersion within which two names are not told apart.
inline constexpr double kNotToldApart_nats = 5;
/// Correlation over poses of the gains of two names from which on they explain the same.
inline constexpr double kCorrelationOfSameName = 0.7;
/// Share of a likelier fit's gain from which on a simpler one explains as much: the move of an actor for an object at
/// its new place, or a name of fewer numbers; and the distance from that actor's plan within which the object stands
/// there.
inline constexpr double kShareOfSimpler = 0.8, kStandsThere_m = 0.1;
/// Size of an object up to which it may be a person, and the distance from the middle of a walk within which it is what
/// is left of the walker.
inline constexpr double kMostPersonSize_m = 0.3, kWalkReach_m = 0.6;
/// Gain over its overdispersion for each pose from which on an offset of radar or scene is no error of the actors; see
/// docs/verification/calibration_of_bounds.md#sure-offset
inline constexpr double kLeastNatsOfOffsetPerPose = 20;
/// Share of a finding's gain from which on a simpler name of its round is kept as its rival.
inline constexpr double kLeastShareOfRival = 0.7;
/// Scattering coefficient S below which rough scattering is no more than a room's clutter; see
/// docs/verification/calibration_of_bounds.md#kleastscattering
inline constexpr double kLeastScattering = 0.15;
/// Scattering coefficient S above which a fit is clutter beside its actors: no surface mirrors nothing; see
/// docs/verification/calibration_of_bounds.md#kleastscattering
inline constexpr double kMostScattering = 0.98;
/// Most that a surface reflects beyond what the twin states, dB: from wood, the least of the shipped materials
/// (permittivity 1.99: |Gamma|^2 is -15.4 dB), to metal.
inline constexpr double kMostReflectivity_db = 15.4;
/// Scattering coefficient S (an eighth of the reflected power) from which on scattering is no clutter; see
/// docs/verification/calibration_of_bounds.md#kleastscattering
inline constexpr double kStrongScattering = 0.35;
/// Gain of a wall's ghost over its scatterers' law below which the ghost consists of edges alone; see
/// docs/verification/calibration_of_bounds.md#kleastghost_db
inline constexpr double kLeastGhost_db = -25;
/// Level of a replica against its echo from which on it is no clutter; see
/// docs/verification/calibration_of_bounds.md#kloudreplica_db
inline constexpr double kLoudReplica_db = -10;
/// Size of an object below which it is one of the small things that lie about; see
/// docs/verification/calibration_of_bounds.md#kfurniture_m
inline constexpr double kFurniture_m = 0.1;
/// Size of an object that any room is full of; see docs/verification/calibration_of_bounds.md#kfurniture_m
inline constexpr double kLeastSize_m = 0.05;
/// Loss of a crossing below which a panel that lets all through is not there; see
/// docs/verification/calibration_of_bounds.md#kleastloss_db
inline constexpr double kLeastLoss_db = 0.5;
/// Share of the measured power that a fit explains more before it counts as gaining in the maps, and less before the
/// maps count as clearly worse; see docs/verification/calibration_of_bounds.md#kleastexplainedmore
inline constexpr double kLeastExplainedMore = 0.002;
/// Correlation over poses of the gains of two fits from which on a name explains some of what a better one was rejected
/// for by the maps; see docs/verification/calibration_of_bounds.md#kcorrelationofsomeshared
inline constexpr double kCorrelationOfSomeShared = 0.2;
/// The same from which on two fits explain the same; see
/// docs/verification/calibration_of_bounds.md#kcorrelationofsomeshared
inline constexpr double kCorrelationOfSame = 0.5;
/// Share of an unknown's gain below which a name beside it is a leftover of the unknown's law; see
/// docs/verification/calibration_of_bounds.md#ksharebesideunknown
inline constexpr double kShareBesideUnknown = 0.25;

// ---- conductor

/// Share of the measured power that a twin has to explain beyond what chance explains before scene and recording belong
/// together; see docs/verification/calibration_of_bounds.md#kleastexplainedbeyondchance
inline constexpr double kLeastExplainedBeyondChance = 0.05;

}  // namespace mmradartwin::diagnosis::bounds
