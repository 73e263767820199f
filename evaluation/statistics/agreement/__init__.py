"""How well raters agree with each other."""

from evaluation.statistics.agreement.annotation import (
    AnnotationAgreement,
    DimensionAgreement,
    annotation_agreement,
    deviation,
)
from evaluation.statistics.agreement.fleiss import CategoryKappa, FleissKappa, fleiss_kappa, fleiss_kappa_of_labels
from evaluation.statistics.agreement.icc import (
    IntraclassCorrelation,
    IntraclassCorrelations,
    MeanSquares,
    intraclass_correlations,
)
from evaluation.statistics.agreement.kappa import CohenKappa, LightKappa, cohen_kappa, light_kappa
from evaluation.statistics.agreement.krippendorff import KrippendorffAlpha, krippendorff_alpha
from evaluation.statistics.agreement.pairwise import (
    MeanPairwiseCorrelation,
    check_pairs,
    check_size,
    check_varying,
    left_out_pairs,
    left_out_raters,
    mean_pairwise_pearson,
    standardised,
)
from evaluation.statistics.agreement.rater_pairs import PairwiseCorrelations, pairwise_pearson

__all__ = [
    "AnnotationAgreement",
    "CategoryKappa",
    "CohenKappa",
    "DimensionAgreement",
    "FleissKappa",
    "IntraclassCorrelation",
    "IntraclassCorrelations",
    "KrippendorffAlpha",
    "LightKappa",
    "MeanPairwiseCorrelation",
    "MeanSquares",
    "PairwiseCorrelations",
    "annotation_agreement",
    "check_pairs",
    "check_size",
    "check_varying",
    "cohen_kappa",
    "deviation",
    "fleiss_kappa",
    "fleiss_kappa_of_labels",
    "intraclass_correlations",
    "krippendorff_alpha",
    "left_out_pairs",
    "left_out_raters",
    "light_kappa",
    "mean_pairwise_pearson",
    "pairwise_pearson",
    "standardised",
]
