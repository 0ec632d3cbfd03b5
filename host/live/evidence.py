"""How much the last innovations speak for each simple change since some moment: likelihood ratios."""

from typing import NamedTuple

import numpy as np

from host.live.innovations import MARKS, NAMES, Innovations
from host.live.reference import Array
from host.live.whitening import Whitening, whitened

WILD = 4.0  # spreads of a white innovation, beyond which more of it is no more evidence


class Lacking(NamedTuple):
    """What the reference lacked all along: sizes of its `MARKS`, (marks,), and their covariance."""

    sizes: Array
    covariance: Array


class Evidence(NamedTuple):
    """Of one instant, by the moments since which a change may have been (the earliest first).

    ratios    white innovations against the mark of each change, (moments, changes): of spread one where
              nothing changed, and c times the leverage where a change of size c came then; less where what
              the reference lacks is not well known and would leave the same
    leverage  length of that mark, (moments, changes)
    squares   sum of the squared innovations since, (moments,)
    gram      inner products of all `MARKS` since the earliest moment, (marks, marks)
    products  theirs with the innovations, before what the reference lacks was taken off, (marks,)
    """

    ratios: Array
    leverage: Array
    squares: Array
    gram: Array
    products: Array


def evidence_of(
    innovations: Innovations, whitening: Whitening, lengths: list[int], lacking: Lacking
) -> Evidence:
    """With the moments so many blocks ago, the longest first."""
    coefficients, scale = whitening.filter()
    white = whitened(innovations.means, coefficients, scale)[-lengths[0] :]
    marks = whitened(innovations.marks(lengths), coefficients, scale)
    lasting = marks[:, :, 0].reshape(-1, len(MARKS))
    gram, products = lasting.T @ lasting, lasting.T @ white.clip(-WILD, WILD).reshape(-1)
    news = (white - (lasting @ lacking.sizes).reshape(white.shape)).clip(-WILD, WILD)
    left = marks[..., : len(NAMES)].reshape(len(lasting), len(lengths), len(NAMES))
    leverage = np.sqrt((left**2).sum(axis=0)) + 1e-9
    shared = np.einsum("rmc,rk->mck", left, lasting) / leverage[..., None]
    doubt = np.einsum("mck,kl,mcl->mc", shared, lacking.covariance, shared)
    ratios = np.einsum("r,rmc->mc", news.reshape(-1), left) / leverage / np.sqrt(1.0 + doubt)
    squares = np.array([float((news[-length:] ** 2).sum()) for length in lengths])
    return Evidence(ratios, leverage, squares, gram, products)
