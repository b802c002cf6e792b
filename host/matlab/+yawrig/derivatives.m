function [found, points] = derivatives(campaign, varargin)
% DERIVATIVES  Aerodynamic derivatives of a campaign, per radian.
%
%   found = yawrig.derivatives('campaign.toml')
%   [found, points] = yawrig.derivatives('campaign.toml', 'method', 'conventional')
%
% FOUND has the names of the program's JSON. POINTS is its table: a column for each value and, ending in _u, for each
% standard uncertainty; in MATLAB a table, in Octave a struct of columns.
  found = yawrig.ask('derivatives', {campaign}, varargin{:});
  if nargout > 1
    points = yawrig.as_table(found.points);
  end
end
