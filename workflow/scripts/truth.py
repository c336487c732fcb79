"""True motion, strain and labels at every pixel of every frame, in all sizes; in volumes the labels at every voxel."""

from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import PixelTruth
from echotruth.repository.datasets import source_of
from echotruth.workflow.job import Job, Result, main


def work(job: Job) -> Result:
    found = {}
    job.notes |= source_of(job.solved, job.plane)
    if job.plane.is_volume:
        axial, elevation, lateral = voxel_centres(job.config)
        return {"truth/volume": PixelTruth(job.heart, job.plane, axial, lateral, elevation=elevation)}
    for size in job.config.bmode.sizes:
        pixels = pixel_centres(job.config.bmode, size)
        tissue = TissueImages(job.config, job.heart, job.plane, *pixels)
        found[f"truth/{size}"] = PixelTruth(job.heart, job.plane, *pixels, tissue)
    return found


if __name__ == "__main__":
    main("truth", work, __doc__)
