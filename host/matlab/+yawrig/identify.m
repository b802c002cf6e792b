function found = identify(varargin)
% IDENTIFY  Natural frequency and damping ratio of a release, with their uncertainties.
%
%   found = yawrig.identify(time_s, angle_deg)
%   found = yawrig.identify('r.csv', 'method', 'all', 'from_deg', 9)
%
% Times in s and angles in deg, or a file of any format that yawrig reads. FOUND has the names of the program's JSON for
% the record, and natural_frequency_rad_s and damping_ratio, each with value and u, of its first estimate. Of several
% files it is the program's whole object.
  [files, options, clean] = yawrig.recorded(varargin); %#ok<ASGLU>
  found = yawrig.ask('identify', files, options{:});
  if numel(files) == 1
    found = found.records(1);
    estimate = found.estimates(1);
    if iscell(estimate)
      estimate = estimate{1};
    end
    found.natural_frequency_rad_s = estimate.natural_frequency_rad_s;
    found.damping_ratio = estimate.damping_ratio;
  end
end
