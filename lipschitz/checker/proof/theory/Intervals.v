(** Networks of intervals: what they enclose. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations ErrorFunction Algebra Form Network Checker Fixed Normal Meaning
    Steepness Sets Lower Values Enclosures.
Import ListNotations.
Open Scope R_scope.

Ltac both H := apply andb_prop in H; destruct H as [H ?].

(** SiLU has one minimum, where e^t + 1 + t is 0. *)
Definition silu_sign (t : R) : R := exp t + 1 + t.
Lemma silu_sign_rises x y : x <= y -> silu_sign x <= silu_sign y.
Proof. intros L. pose proof (exp_rises x y L). unfold silu_sign. lra. Qed.
Lemma silu_slope_sign x : exists k, 0 < k /\ silu_slope x = k * silu_sign x.
Proof.
  pose proof (exp_pos (- x)). pose proof (exp_opp x) as O. exists (exp (- x) / Rsqr (1 + exp (- x))). split.
  - apply Rdiv_lt_0_compat; auto. unfold Rsqr. nra.
  - unfold silu_slope, silu_sign, Rsqr, Rdiv. rewrite (Rmult_comm (exp (- x)) (/ _)), Rmult_assoc, Rmult_comm. f_equal.
    rewrite !Rmult_plus_distr_l, (Rmult_comm (exp (- x)) (exp x)), O. ring.
Qed.
Lemma silu_falls x y : x <= y -> silu_sign y <= 0 -> act Silu y <= act Silu x.
Proof.
  intros L S. pose proof (at_most_the_derivative (act Silu) silu_slope 0 x y L) as D.
  enough (act Silu y - act Silu x <= 0 * (y - x)) by lra. apply D. intros c [_ Hc]. split; [apply silu_derivative|].
  destruct (silu_slope_sign c) as (k & K & ->). pose proof (silu_sign_rises c y Hc). nra.
Qed.
Lemma silu_rises x y : x <= y -> 0 <= silu_sign x -> act Silu x <= act Silu y.
Proof.
  intros L S. pose proof (at_least_the_derivative (act Silu) silu_slope 0 x y L) as D.
  enough (0 * (y - x) <= act Silu y - act Silu x) by lra. apply D. intros c [Hc _]. split; [apply silu_derivative|].
  destruct (silu_slope_sign c) as (k & K & ->). pose proof (silu_sign_rises x c Hc). nra.
Qed.
Lemma exp_at_most t u : at_most (snd (exp_of_minus_size t), (-256)%Z) u = true -> exp (- Rabs (real t)) <= real u.
Proof. intros H. apply at_most_real in H. pose proof (inside_ends _ _ (inside_exp_size t)). lra. Qed.
Lemma exp_at_least t u : at_most u (fst (exp_of_minus_size t), (-256)%Z) = true -> real u <= exp (- Rabs (real t)).
Proof. intros H. apply at_most_real in H. pose proof (inside_ends _ _ (inside_exp_size t)). lra. Qed.
Lemma over_power m p : real (m, Z.neg p) = IZR m / IZR (2 ^ Z.pos p).
Proof. rewrite real_below, pow_IZR, positive_nat_Z. reflexivity. Qed.
Lemma silu_minimum_holds : let '(from, to, value) := minimum_of Silu in
  silu_sign (real from) <= 0 /\ 0 <= silu_sign (real to) /\ forall x, real value <= act Silu x.
Proof.
  unfold minimum_of, silu_sign.
  pose proof (exp_at_most (-1340568, -20)%Z (291992, -20)%Z ltac:(vm_compute; reflexivity)) as A.
  pose proof (exp_at_least (-1340567, -20)%Z (291991, -20)%Z ltac:(vm_compute; reflexivity)) as B.
  pose proof (exp_at_most (-335142, -18)%Z (72998, -18)%Z ltac:(vm_compute; reflexivity)) as C.
  rewrite !over_power in *. change (2 ^ 20)%Z with 1048576%Z in *. change (2 ^ 18)%Z with 262144%Z in *.
  rewrite Rabs_left, Ropp_involutive in A, B, C by lra. split; [lra|]. split; [lra|]. intros x.
  cbn [act]. pose proof (exp_pos (- x)). apply divided_below; [lra|]. set (w := 72998 / 262144) in *.
  assert (0 < w) by (unfold w; lra). replace (-72998 / 262144) with (- w) by (unfold w; lra).
  replace (-335142 / 262144) with (- (1 + w)) in C by (unfold w; lra). clearbody w.
  destruct (Rle_lt_dec 0 (x + w)); [nra|].
  (* At the minimum of x + w + w e^-x, where - x = 1 + w. *)
  pose proof (exp_above_line (- x - (1 + w))) as T. pose proof (exp_opp (1 + w)) as O. pose proof (exp_pos (1 + w)).
  assert (exp (- x) = exp (1 + w) * exp (- x - (1 + w))) as E by (rewrite <- exp_plus; f_equal; ring).
  assert (1 <= w * exp (1 + w)) by nra. assert (- x - w <= w * exp (- x)); [|nra].
  rewrite E. set (d := exp (- x - (1 + w))) in *. nra.
Qed.

(** GELU: between `from` and `to` its derivative is at most 2^-22. *)
Lemma gelu_falls x y : x <= y -> gelu_derivative_at y <= 0 -> act Gelu y <= act Gelu x.
Proof.
  intros L S. enough (act Gelu y - act Gelu x <= 0 * (y - x)) by lra.
  apply (at_most_the_derivative _ gelu_derivative_at); auto. intros c [_ Hc]. split; [apply gelu_derivative_holds|].
  now apply (gelu_derivative_sign c y Hc).
Qed.
Lemma gelu_rises x y : x <= y -> 0 <= gelu_derivative_at x -> act Gelu x <= act Gelu y.
Proof.
  intros L S. enough (0 * (y - x) <= act Gelu y - act Gelu x) by lra.
  apply (at_least_the_derivative _ gelu_derivative_at); auto. intros c [Hc _]. split; [apply gelu_derivative_holds|].
  now apply (gelu_derivative_sign x c Hc).
Qed.
Definition gelu_slopeF (t : dyadic) : fixed :=
  addF (probabilityF t) (mulF (of_dyadic t) (densityF (of_dyadic (abs t)))).
Lemma inside_gelu_slope t : inside (gelu_slopeF t) (gelu_derivative_at (real t)).
Proof.
  rewrite gelu_derivative_sum. apply inside_add; [apply inside_normal|].
  apply inside_mul; [apply inside_dyadic|apply inside_density_size].
Qed.
Lemma gelu_minimum_holds : let '(from, to, value) := minimum_of Gelu in
  gelu_derivative_at (real from) <= 0 /\ 0 <= gelu_derivative_at (real to) /\ forall x, real value <= act Gelu x.
Proof.
  unfold minimum_of. set (from := (-1576622, -21)%Z). set (to := (-1576620, -21)%Z). set (value := (-1425822, -23)%Z).
  pose proof (inside_ends _ _ (inside_gelu_slope from)) as [_ A]. pose proof (inside_ends _ _ (inside_gelu_slope to)) as
    [B C].
  pose proof (inside_ends _ _ (value_at_inside Gelu to eq_refl eq_refl)) as [V _].
  assert (at_most (snd (gelu_slopeF from), (-256)%Z) zero = true) as A' by (vm_compute; reflexivity).
  assert (at_most zero (fst (gelu_slopeF to), (-256)%Z) = true) as B' by (vm_compute; reflexivity).
  assert (at_most (snd (gelu_slopeF to), (-256)%Z) (1, -22)%Z = true) as C' by (vm_compute; reflexivity).
  assert (at_most (add value (1, -41)%Z) (fst (value_at Gelu to), (-256)%Z) = true) as V' by (vm_compute; reflexivity).
  apply at_most_real in A', B', C', V'. rewrite real_zero in A', B'. rewrite real_add in V'.
  assert (gelu_derivative_at (real from) <= 0) as F by lra. assert (0 <= gelu_derivative_at (real to)) as G by lra.
  split; [exact F|]. split; [exact G|]. clear A A' B B' F. intros x.
  generalize dependent (fst (value_at Gelu to), (-256)%Z). generalize dependent (snd (gelu_slopeF to), (-256)%Z).
  intros d C C' v V V'. assert (real to - real from = real (1, -20)%Z) as W.
  { unfold to, from. rewrite !over_power. change (2 ^ 21)%Z with (2 * 2 ^ 20)%Z. rewrite mult_IZR.
    change (2 ^ 20)%Z with 1048576%Z. lra. }
  assert (real (1, -22)%Z * real (1, -20)%Z <= real (1, -41)%Z) as Small.
  { rewrite <- real_mul. apply at_most_real. reflexivity. }
  assert (real from < real to) as O by (pose proof (real_positive (1, -20)%Z eq_refl); lra).
  assert (- 1 <= real from / sqrt 2) as Inner.
  { pose proof sqrt_2_positive as P. assert (1 <= sqrt 2) by (rewrite <- sqrt_1; apply sqrt_le_1_alt; lra).
    apply (Rmult_le_reg_r (sqrt 2)); auto. rewrite over_root_2. assert (-1 <= real from); [|lra].
    unfold from. rewrite over_power. change (2 ^ 21)%Z with 2097152%Z. lra. }
  assert (real to < 0) as N by (unfold to; rewrite over_power; change (2 ^ 21)%Z with 2097152%Z; lra).
  assert (forall z, real from <= z -> real value <= act Gelu z) as Right.
  { intros z Hz. destruct (Rle_lt_dec (real to) z) as [L|L].
    - pose proof (gelu_rises (real to) z L G). pose proof (real_positive (1, -41)%Z eq_refl). lra.
    - assert (act Gelu (real to) - act Gelu z <= real (1, -22)%Z * (real to - z)) as D.
      { apply (at_most_the_derivative _ gelu_derivative_at); [lra|]. intros c Hc.
        split; [apply gelu_derivative_holds|]. apply Rle_trans with (gelu_derivative_at (real to)); [|lra].
        unfold gelu_derivative_at. pose proof sqrt_2_positive as P. apply Rinv_0_lt_compat in P.
        assert (forall a b, a <= b -> a / sqrt 2 <= b / sqrt 2) as M
          by (intros a b Hab; unfold Rdiv; apply Rmult_le_compat_r; lra).
        apply gelu_slope_rises; [|apply M; lra|].
        - eapply Rle_trans; [exact Inner|]. apply M. lra.
        - pose proof (M (real to) 0 ltac:(lra)) as M0. unfold Rdiv in M0 at 2. lra. }
      assert (real (1, -22)%Z * (real to - z) <= real (1, -22)%Z * real (1, -20)%Z)
        by (apply Rmult_le_compat_l; [left; now apply real_positive|lra]). lra. }
  destruct (Rle_lt_dec (real from) x) as [L|L]; [now apply Right|].
  pose proof (Right (real from) (Rle_refl _)). pose proof (inside_ends _ _ (inside_gelu_slope from)) as [_ A].
  assert (at_most (snd (gelu_slopeF from), (-256)%Z) zero = true) as A' by (vm_compute; reflexivity).
  apply at_most_real in A'. rewrite real_zero in A'. pose proof (gelu_falls x (real from) ltac:(lra) ltac:(lra)). lra.
Qed.
(** Of both. *)
Lemma minimum_holds a : is_rising a = false -> let '(from, to, value) := minimum_of a in
  (forall x y, x <= y -> y <= real from -> act a y <= act a x) /\
  (forall x y, real to <= x -> x <= y -> act a x <= act a y) /\ (forall x, real value <= act a x) /\
  (forall l x h, l <= x <= h -> act a x <= Rmax (act a l) (act a h)).
Proof.
  intros R. pose proof silu_minimum_holds as M. pose proof gelu_minimum_holds as N.
  destruct a; try discriminate; [destruct (minimum_of Silu) as [[from to] value]; destruct M as (F & T & V)|
    destruct (minimum_of Gelu) as [[from to] value]; destruct N as (F & T & V)];
    (split; [|split; [|split; [exact V|]]]).
  - intros x y L H. apply silu_falls; auto. pose proof (silu_sign_rises y (real from) H). lra.
  - intros x y H L. apply silu_rises; auto. pose proof (silu_sign_rises (real to) x H). lra.
  - intros l x h [L H]. pose proof (Rmax_l (act Silu l) (act Silu h)). pose proof (Rmax_r (act Silu l) (act Silu h)).
    destruct (Rle_lt_dec (silu_sign x) 0) as [S|S].
    + pose proof (silu_falls l x L S). lra.
    + pose proof (silu_rises x h H ltac:(lra)). lra.
  - intros x y L H. apply gelu_falls; auto. now apply (gelu_derivative_sign y (real from) H).
  - intros x y H L. apply gelu_rises; auto. now apply (gelu_derivative_sign (real to) x H).
  - intros l x h [L H]. pose proof (Rmax_l (act Gelu l) (act Gelu h)). pose proof (Rmax_r (act Gelu l) (act Gelu h)).
    destruct (Rle_lt_dec (gelu_derivative_at x) 0) as [S|S].
    + pose proof (gelu_falls l x L S). lra.
    + pose proof (gelu_rises x h H ltac:(lra)). lra.
Qed.

Lemma within_length b x : within b x -> length x = length b.
Proof. revert x. induction b as [|[l h] b IH]; intros [|a x]; simpl; try tauto. intros [_ H]. f_equal; auto. Qed.
Lemma real_clamped c x : reals (clampedD c x) = clamped c (reals x).
Proof.
  revert x. induction c as [|[l h] c IH]; intros [|a x]; simpl; auto. f_equal; auto.
  assert (forall p q, real (if at_most p q then q else p) = Rmax (real p) (real q)) as M.
  { intros p q. unfold Rmax. destruct (at_most p q) eqn:E.
    - apply at_most_real in E. destruct (Rle_dec _ _); lra.
    - apply at_most_false in E. destruct (Rle_dec _ _); lra. }
  rewrite <- M. set (b := if at_most a l then l else a). unfold Rmin. destruct (at_most b h) eqn:E.
  - apply at_most_real in E. destruct (Rle_dec _ _); lra.
  - apply at_most_false in E. destruct (Rle_dec _ _); lra.
Qed.
Fixpoint all_below (x y : list R) : Prop :=
  match x, y with a :: x', b :: y' => a <= b /\ all_below x' y' | [], [] => True | _, _ => False end.
Lemma below_clamped c x y : all_below x y -> all_below (clamped c x) (clamped c y).
Proof.
  revert x y. induction c as [|[l h] c IH]; intros [|a x] [|b y]; simpl; try tauto. intros [H G]. split; auto.
  apply Rle_min_compat_r, Rle_max_compat_r, H.
Qed.
Lemma within_below b x : within b x <-> all_below (reals (map fst b)) x /\ all_below x (reals (map snd b)).
Proof.
  revert x. induction b as [|[l h] b IH]; intros [|a x]; simpl; try tauto. rewrite IH. tauto.
Qed.
Lemma below_combine l h x : all_below (reals l) x -> all_below x (reals h) -> within (combine l h) x.
Proof.
  revert h x. induction l as [|a l IH]; intros [|b h] [|c x]; simpl; try tauto. intros [H1 H2] [G1 G2]. auto.
Qed.
Lemma within_clamped c b x : within b x -> within (clamp_ends c b) (clamped c x).
Proof.
  intros H. apply within_below in H. destruct H as [H G]. apply below_combine; rewrite real_clamped;
    now apply below_clamped.
Qed.
Lemma row_ends_within row b x : within b x ->
  real (fst (row_ends row b)) <= dotR (reals row) x <= real (snd (row_ends row b)).
Proof.
  revert b x. induction row as [|w row IH]; intros [|[l h] b] [|a x]; simpl; try tauto; try (rewrite real_zero; lra).
  intros [H G]. specialize (IH _ _ G). destruct (row_ends row b) as [s t]. simpl in *.
  destruct (is_nonnegative w) eqn:E; simpl; rewrite !real_add, !real_mul.
  - apply real_nonnegative in E. nra.
  - apply negative_real in E. nra.
Qed.
Lemma relu_within b x : within b x -> within (map relu_ends b) (map relu x).
Proof.
  revert x. induction b as [|[l h] b IH]; intros [|a x]; simpl; try tauto. intros [H G]. rewrite !real_relu.
  split; [|auto]. unfold relu. split; apply Rle_max_compat_l; lra.
Qed.

(** Of single numbers *)
Definition lies (i : dyadic * dyadic) (x : R) : Prop := real (fst i) <= x <= real (snd i).
Lemma real_smaller x y : real (smaller x y) = Rmin (real x) (real y).
Proof.
  unfold smaller, Rmin. destruct (at_most x y) eqn:E; [apply at_most_real in E|apply at_most_false in E];
    destruct (Rle_dec _ _); lra.
Qed.
Lemma real_larger x y : real (larger x y) = Rmax (real x) (real y).
Proof.
  unfold larger, Rmax. destruct (at_most x y) eqn:E; [apply at_most_real in E|apply at_most_false in E];
    destruct (Rle_dec _ _); lra.
Qed.
Lemma below_real x y : below x y = true -> real x < real y.
Proof. unfold below. intros H. apply negb_true_iff in H. now apply at_most_false. Qed.
Lemma same_eq x y : same x y = true -> x = y.
Proof.
  unfold same. destruct x, y. simpl. intros H. both H. apply Z.eqb_eq in H, H0. congruence.
Qed.
Lemma same_value a i : (if same (fst i) (snd i) then value_at a (fst i) else value_at a (snd i)) = value_at a (snd i).
Proof. destruct (same (fst i) (snd i)) eqn:E; [apply same_eq in E; rewrite E|]; reflexivity. Qed.
Lemma rising a x y : is_rising a = true -> x <= y -> act a x <= act a y.
Proof. intros R L. destruct (rising_slopes a R) as [_ S]. specialize (S x y L). lra. Qed.
Theorem values_between_lies a i x : is_relu a = false -> is_entrywise a = true -> lies i x ->
  lies (values_between a i) (act a x).
Proof.
  intros R E [L H]. unfold values_between. rewrite same_value.
  destruct (inside_ends _ _ (value_at_inside a (fst i) R E)) as [L1 L2].
  destruct (inside_ends _ _ (value_at_inside a (snd i) R E)) as [H1 H2].
  set (v := value_at a (fst i)) in *. set (w := value_at a (snd i)) in *. clearbody v w.
  destruct (is_rising a) eqn:G.
  - unfold lies. cbn [fst snd]. pose proof (floor_to_below (-64) (fst v, (-256)%Z)).
    pose proof (ceil_to_above (-64) (snd w, (-256)%Z)). pose proof (rising a _ _ G L). pose proof (rising a _ _ G H).
    lra.
  - pose proof (minimum_holds a G) as M.
    destruct (minimum_of a) as [[from to] value]. destruct M as (F & T & V & Most). unfold lies. cbn [fst snd].
    set (low := if below (snd i) from || below to (fst i) then smaller (fst v, (-256)%Z) (fst w, (-256)%Z) else value).
    pose proof (floor_to_below (-64) low).
    pose proof (ceil_to_above (-64) (larger (snd w, (-256)%Z) (snd v, (-256)%Z))) as Above.
    rewrite real_larger in Above.
    pose proof (Rmax_l (real (snd w, (-256)%Z)) (real (snd v, (-256)%Z))).
    pose proof (Rmax_r (real (snd w, (-256)%Z)) (real (snd v, (-256)%Z))). split.
    + enough (real low <= act a x) by lra. unfold low.
      destruct (below (snd i) from) eqn:B; [|destruct (below to (fst i)) eqn:B']; cbn [orb]; [| |apply V];
        rewrite real_smaller; pose proof (Rmin_l (real (fst v, (-256)%Z)) (real (fst w, (-256)%Z)));
        pose proof (Rmin_r (real (fst v, (-256)%Z)) (real (fst w, (-256)%Z))).
      * apply below_real in B. pose proof (F x (real (snd i)) H ltac:(lra)). lra.
      * apply below_real in B'. pose proof (T (real (fst i)) x ltac:(lra) L). lra.
    + specialize (Most (real (fst i)) x (real (snd i)) (conj L H)). revert Most. unfold Rmax in *.
      repeat destruct (Rle_dec _ _); lra.
Qed.

(** Of layers *)
Lemma within_lies b x : within b x <-> Forall2 lies b x.
Proof.
  revert x. induction b as [|[l h] b IH]; intros [|a x]; simpl.
  - split; constructor.
  - split; [tauto|intros H; inversion H].
  - split; [tauto|intros H; inversion H].
  - rewrite IH. split; [intros [H G]; constructor; auto|intros H; inversion H; auto].
Qed.
Section Related.
Context {A B : Type} (R : A -> B -> Prop) (low high : A -> A -> A) (low' high' : B -> B -> B)
  (lows : forall a b c d, R a b -> R c d -> R (low a c) (low' b d))
  (highs : forall a b c d, R a b -> R c d -> R (high a c) (high' b d)).
Lemma related_inserted a b l m : R a b -> Forall2 R l m -> Forall2 R (inserted low high a l) (inserted low' high' b m).
Proof. intros H F. revert a b H. induction F; intros; simpl; auto. Qed.
Lemma related_ascending l m : Forall2 R l m -> Forall2 R (ascending low high l) (ascending low' high' m).
Proof. intros F. induction F; simpl; auto. now apply related_inserted. Qed.
Lemma related_firstn k l m : Forall2 R l m -> Forall2 R (firstn k l) (firstn k m).
Proof. intros F. revert k. induction F; intros [|k]; simpl; auto. Qed.
Lemma related_skipn k l m : Forall2 R l m -> Forall2 R (skipn k l) (skipn k m).
Proof. intros F. revert k. induction F; intros [|k]; simpl; auto. Qed.
Lemma related_groups n k l m : Forall2 R l m -> Forall2 R (sorted_groups low high n k l) (sorted_groups low' high' n k
  m).
Proof.
  revert l m. induction n; intros l m F; simpl; auto.
  apply Forall2_app; [apply related_ascending, related_firstn, F|apply IHn, related_skipn, F].
Qed.
Lemma related_both f f' l m u v : (forall a b c d, R a b -> R c d -> R (f a c) (f' b d)) -> Forall2 R l u ->
  Forall2 R m v -> Forall2 R (Activations.both f l m) (Activations.both f' u v).
Proof.
  intros H F. revert m v. induction F; intros m v G; unfold Activations.both in *; simpl; auto.
  inversion G; subst; simpl; auto.
Qed.
Lemma related_pairs f f' n : (forall a b c d, R a b -> R c d -> R (f a c) (f' b d)) ->
  forall l m, (length l <= n)%nat ->
  Forall2 R l m -> Forall2 R (of_pairs f l) (of_pairs f' m).
Proof.
  intros H. induction n as [|n IH]; intros l m L F; destruct F as [|? ? ? ? ? F]; simpl; auto; simpl in L; [lia|].
  destruct F; simpl; auto. constructor; auto. apply IH; auto. simpl in L. lia.
Qed.
Lemma related_length l m : Forall2 R l m -> length l = length m.
Proof. intros F. induction F; simpl; auto. Qed.
Lemma related_sorted s l m : Forall2 R l m -> Forall2 R (sorted_by low high s l) (sorted_by low' high' s m).
Proof.
  intros F. pose proof (related_length _ _ F) as E. destruct s; simpl.
  - rewrite E. now apply related_groups.
  - unfold of_halves. rewrite E. apply Forall2_app; apply related_both; auto using related_firstn, related_skipn.
  - apply Forall2_app; apply related_pairs with (n := length l); auto.
Qed.
End Related.
Lemma sorted_within s b x : within b x -> within (sorted_by least_ends greatest_ends s b) (sort_layer s x).
Proof.
  rewrite !within_lies. apply related_sorted; intros i a j c [L H] [L' H']; unfold lies, least_ends, greatest_ends;
    cbn [fst snd]; rewrite ?real_smaller, ?real_larger.
  - unfold Rmin. repeat destruct (Rle_dec _ _); lra.
  - unfold Rmax. repeat destruct (Rle_dec _ _); lra.
Qed.
Lemma activated_within a b x : within b x -> within (activated_ends a b) (activated a x).
Proof.
  assert (forall c b x, is_relu c = false -> is_entrywise c = true -> within b x ->
    within (map (values_between c) b) (map (act c) x)) as W.
  { clear. intros c b x Q E H. rewrite within_lies in *. induction H; simpl; constructor; auto.
    now apply values_between_lies. }
  revert b x. induction a as [| | | | | | | |s|n a IH]; intros b x H; try (now apply W);
    [now apply relu_within|now apply sorted_within|]. rewrite within_lies in H.
  apply within_lies, Forall2_app; [|now apply related_skipn].
  apply within_lies, IH, within_lies. now apply related_firstn.
Qed.
Lemma plus_within a b x y : within a x -> within b y -> within (plus_ends a b) (plusR x y).
Proof.
  revert b x y. induction a as [|[l h] a IH]; intros [|[m k] b] [|c x] [|d y]; simpl; try tauto.
  intros [H H'] [G G']. rewrite !real_add. split; [lra|auto].
Qed.
Lemma affine_within l b x : within b x -> within (affine_ends l b) (affine (fst (real_layer l)) (snd (real_layer l)) x).
Proof.
  intros H. apply plus_within; simpl.
  - induction (fst l) as [|row m IH]; simpl; auto. pose proof (row_ends_within row b x H) as E.
    destruct (row_ends row b). split; auto.
  - induction (snd l) as [|c cs IH]; simpl; auto. split; [lra|auto].
Qed.
Lemma network_within between hidden last b x : within b x ->
  within (network_ends between hidden last b) (layer_by_layer between (map real_layer hidden) (real_layer last) x).
Proof.
  revert between b x. induction hidden as [|l hidden IH]; intros between b x H; simpl; [now apply affine_within|].
  apply IH. now apply activated_within, affine_within.
Qed.
